// Whether the values of a set-up quantity scatter more than its prior says. Internal: not installed.
// The values x of all lines and components have the priors p, C = P^-1/2 U P^-1/2 is their covariance after the
// adjustment by these. Under the priors, T = sum (x/p)^2 is a sum of eigenvalue times chi-square(1), of the matrix
// M = 1 - C; its mean is tr M. What the readings do not tell has eigenvalues of 0 and takes no part: many small values
// that have something in common, as the drifts of all lines, are tested where no single one is far from its prior. Of
// values that really scatter k times as much the mean is tr M + (k^2 - 1) tr M^2, from which k is estimated.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment/bordered_band.hpp"
#include "diagnosis/residual_tests.hpp"

namespace stepdiag {

// Of each quantity that has informative priors and is told at all; probabilities times the number of quantities.
std::vector<ResidualPattern> prior_scatter(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                           const BorderedFactor& factor);

}  // namespace stepdiag
