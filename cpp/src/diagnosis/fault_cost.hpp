// What the treatment of faults costs: the calibration with it beside the one of the same run with nothing left out or
// freed. Internal: not installed.
#pragma once

#include <vector>

#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

// A reason for each family (positioning, straightness, angle, squareness) of which the largest standard uncertainty is
// more than `thresholds.fault_cost` times what it was, and one where values are not determined any more. `without`:
// with the same weights.
std::vector<FitReason> costs_of_faults(const Calibration& with, const Calibration& without);

}  // namespace stepdiag
