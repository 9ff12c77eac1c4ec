// What is wrong with the readings of a run, whatever the machine is. Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_problem.hpp"

namespace stepdiag {

// Where readings go with what is known less probably, it is asked whether they are wrong.
inline constexpr double readings_asked_below = 1e-2;

// The faults that an adjustment of the run alone finds, with a machine that is not known. A change of the machine is
// none of them. None where there is no such adjustment.
std::vector<FaultClass> faults_of_run(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options);

// Leaves out all readings that the faults may have spoilt: of a slip and a factor the channel on its line.
void leave_out(const std::vector<FaultClass>& faults, AdjustmentProblem& problem);

}  // namespace stepdiag
