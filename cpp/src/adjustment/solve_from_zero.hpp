// The adjustment's solution without any knowledge of where it is. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "adjustment/gauss_newton.hpp"

namespace stepdiag {

// From zero to the minimum: the number of steps, or none where no minimum is reached. `determined`: the unknowns that
// the readings determine; the others are assumed to be usual, in the end where they came out. Several paths are tried
// where the first ends at a square sum that no sound run has; the least minimum counts.
std::optional<int> solve_from_zero(GaussNewton& solver, const std::vector<bool>& determined, Eigen::VectorXd& x,
                                   int most_steps = GaussNewton::usual_most_steps);

}  // namespace stepdiag
