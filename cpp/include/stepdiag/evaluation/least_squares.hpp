// Weighted linear least squares by pseudoinverse (eq. 5 of the paper, with weights) that says what it can determine.
//   x = A+ b,  A+ = (A^T W A)^-1 A^T W where A has full rank, W = diag(1/u^2);  Cov(x) = A+ Cov(b) A+^T (eq. 6)
#pragma once

#include <Eigen/Core>
#include <vector>

namespace stepdiag {

struct LeastSquares {
    Eigen::MatrixXd
        pseudoinverse;  // A+, unknowns x equations; of minimum norm (columns scaled to 1) where rank is lacking
    int rank;
    // Unknown j is determined where e_j lies in the row space of A: no solution of A x = 0 has a part in it.
    std::vector<bool> determined;
    // A row for each equation more than the rank: sums of equations whose left sides cancel, so that those of the right
    // sides are noise.
    Eigen::MatrixXd contradictions = {};
};

// `standard_uncertainty`: one positive value an equation. Rank is decided on the weighted equations with columns scaled
// to length 1: pivots below 1e-9 of the largest count as zero.
LeastSquares solve_least_squares(const Eigen::MatrixXd& equations, const Eigen::VectorXd& standard_uncertainty);

}  // namespace stepdiag
