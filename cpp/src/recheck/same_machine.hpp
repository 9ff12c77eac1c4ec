// What readings and the calibration that predicts them must have in common. Internal: not installed.
#pragma once

#include "adjustment/adjustment_problem.hpp"

namespace stepdiag {

// The readings, with the options of an adjustment as they count where the machine is known. Throws InvalidArgument for
// another chain, volume or tool, for temperatures that the two refer to differently, and where all readings are lost.
AdjustmentProblem problem_of_known_machine(const Calibration& calibration, const Measurement& measurement,
                                           const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                                           const HeadCalibrations& heads, const AdjustmentOptions& options);

}  // namespace stepdiag
