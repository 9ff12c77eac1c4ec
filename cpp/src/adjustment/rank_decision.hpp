// The rank decision: which unknowns the readings leave open. Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment/bordered_band.hpp"

namespace stepdiag {

// Rank is decided on the normal equations at zero, columns scaled to 1: a pivot at or below this counts as 0. It is the
// square of a singular value: directions known 3e5 times worse than the best ones still count as determined.
inline constexpr double rank_threshold = 1e-11;

// One unknown for each dimension that the readings leave open: those that the factor of the normal equations at zero
// has held because they depend on the others. (The band has places without an unknown, which are held too.)
inline std::vector<int> dependent_unknowns(const AdjustmentProblem& problem, const BorderedFactor& factor) {
    std::vector<int> dependent;
    for (const int j : factor.held())
        if (j >= 6 * problem.blocks() || j % 6 < 3 || problem.has_rotations()) dependent.push_back(j);
    return dependent;
}

}  // namespace stepdiag
