// The linear maps of the published evaluations, written down as programs: from the lengths and tilts of all readings to
// what evaluate_enhanced and evaluate_conventional determine of them. Weights are those of these passes. Internal.
#pragma once

#include "evaluation/linear_program.hpp"
#include "evaluation/passes.hpp"

namespace stepdiag {

LinearProgram enhanced_program(const std::vector<Pass>& passes, const Plan& plan, const Chain& chain,
                               const Eigen::Vector3d& tool);
LinearProgram conventional_program(const std::vector<Pass>& passes, const Plan& plan);

}  // namespace stepdiag
