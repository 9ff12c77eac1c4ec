// Which faults the readings control, and what the others do to a calibration. Internal: not installed.
#pragma once

#include "adjustment/adjustment_result.hpp"
#include "adjustment/solution.hpp"
#include "diagnosis/fault_tests.hpp"

namespace stepdiag {

// Readings and slips of distances, then of tilts or spots, as far as there are any. At the solver's last linearisation.
// A solution for each place, and one for each of its twins; a run that has more places than memory for the effects of
// all (the tables of 50 steps need none of this) is looked at in evenly spaced ones. `noise`: how much larger than
// stated all readings' noise is, by which faults must be larger to be found.
std::vector<FaultControl> reliability(Solution& solution, const CalibratedForms& forms, double noise = 1.0);

// What faults of each kind may do unseen: the worst places only, so that every adjustment can say it. `tests`: at the
// solution.
std::vector<UnseenFault> unseen_faults(Solution& solution, const FaultTests& tests, const CalibratedForms& forms,
                                       double noise = 1.0);

}  // namespace stepdiag
