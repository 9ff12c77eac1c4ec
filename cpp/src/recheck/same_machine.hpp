// What readings and the calibration that predicts them must have in common. Internal: not installed.
#pragma once

#include "stepdiag/adjustment/options.hpp"

namespace stepdiag {

// Throws InvalidArgument for another chain, volume or tool, or temperatures that the two refer to differently.
void check_same_machine(const Calibration& calibration, const Plan& plan, const Chain& chain,
                        const Eigen::Vector3d& tool, const AdjustmentOptions& options);

// The options of an adjustment as they count where the machine is known.
AdjustmentOptions of_known_machine(AdjustmentOptions options);

}  // namespace stepdiag
