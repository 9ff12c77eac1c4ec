// How smooth each error function is, found by generalised cross-validation. Internal: not installed.
#pragma once

#include <array>

#include "adjustment/gauss_newton.hpp"

namespace stepdiag {

// The deviations of second differences, by function, that are given.
std::array<double, function_count> given_deviations(const Smoothness& smoothness);

// Those in force at the start: the given ones, or none, or none yet where they are cross-validated.
std::array<double, function_count> smoothness_at_start(const AdjustmentOptions& options);

// Deviations that make n RSS/(n - tr H)^2 least (G. Wahba, Spline Models for Observational Data, SIAM 1990, ch. 4): RSS
// the weighted square sum of the residuals, H the matrix that makes adjusted readings of readings. On the problem
// linearised at x; function by function, so that one that is not smooth hides behind no other. Leaves the equations
// with the deviations found.
std::array<double, function_count> cross_validate(GaussNewton& solver, const Eigen::VectorXd& x,
                                                  const AdjustmentOptions& options);

}  // namespace stepdiag
