// What the residuals of an adjustment have in common: lines, channels or times that scatter more than the others, and
// trends with time or position. Internal: not installed.
//
// Scatter. The readings of a group have the square sum Q = sum w^2 of weighted residuals and the freedom f = sum of
// their redundancies, which is the mean of Q. Q is a sum of eigenvalue times chi-square(1), with eigenvalues of at most
// 1 that add up to f, and so has tails no longer than chi-square(f): Q/f against that of all other readings is tested
// as F, on both sides, which errs on the safe side. A factor that all uncertainties share cancels. A part of f is owed
// to priors; set-ups that scatter less than their priors do not make the instrument any better, so a group reads less
// than the others only if it does so without that part, too.
//
// Trends. The readings are off by a size times how far along they are: the score test of diagnosis/fault_tests.hpp,
// exact under the model: correlations of residuals and unequal redundancies are in q. Where the unknowns
// absorb the trend (a drift linear in time of a line that is measured once, a scale), q is 0: no test, nothing is said.
#pragma once

#include <functional>
#include <vector>

#include "adjustment/bordered_band.hpp"
#include "adjustment/normal_equations.hpp"
#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

struct ResidualPattern {
    FitReason reason;
    // That chance alone makes the most conspicuous of all patterns as conspicuous as this one: its own probability
    // times the number of tests (Bonferroni).
    double probability;
};

// An adjustment's residuals again, with the redundancies that they owe to noise alone (NormalEquations).
using ResidualsByNoise = std::function<const std::vector<ReadingResidual>&()>;

// All readings together, where they scatter less than stated.
ResidualPattern less_noise(const std::vector<ReadingResidual>& residuals, const ResidualsByNoise& by_noise);

// The group that scatters most conspicuously, then the trends that explain most: the best, and those whose chi-square
// is less than 25 and less than half of it behind, since the readings do not distinguish those. The equations are
// linearised, and factorised, at the solution.
std::vector<ResidualPattern> residual_patterns(const Adjustment& adjustment, const ResidualsByNoise& by_noise,
                                               const Measurement& measurement, const NormalEquations& equations,
                                               const BorderedFactor& factor);

}  // namespace stepdiag
