// How well slips are controlled: q = c^T R c (fault_tests.hpp) of c = 1/u at the readings of a sequence from one of
// them on, for all of them. Internal: not installed.
// A sequence that goes along the band adds its readings in the order of elimination. So of v = L^-1 J^T h, h being the
// weights of the readings added so far, what belongs to blocks that no later reading touches is final; the rest, r,
// touches only the blocks that are coupled with the next one and the border. There N^-1 is known, and the next reading,
// of weight a = 1/u and weighted derivative j, changes
//   h^T R h   by   a^2 (1 - j^T N^-1 j) - 2 a j^T N^-1 r,
// in time that does not depend on the number of blocks. The band is folded: it begins with both ends of travel. So a
// sequence is cut where it turns. A slip within a part is a sum of readings of that part, and of all readings from its
// beginning (less the sum) or from its end (more the sum) on; the latter takes one solution a part.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "adjustment/normal_equations.hpp"

namespace stepdiag {

// The readings of one channel in one set-up, in the order in which they were made: into AdjustmentProblem::readings().
struct ReadingSequence {
    int setup;
    int channel;
    std::vector<int> readings;
};

// By sequence, and by the place in it where the slip begins. `sequences`: those of a set-up beside each other.
// `inverse`: of N, from `factor`; `variances`: of the readings, from it; `weight`: by reading, 1/u, or 0 where it is
// left out.
std::vector<std::vector<double>> slip_squares(const std::vector<ReadingSequence>& sequences,
                                              const NormalEquations& equations, const BorderedFactor& factor,
                                              const BorderedBand& inverse, const Eigen::VectorXd& variances,
                                              const Eigen::VectorXd& weight);

}  // namespace stepdiag
