// Weighted linear least squares by pseudoinverse (eq. 5 of the paper, with weights) that says what it can determine.
//   x = A+ b,  A+ = (A^T W A)^-1 A^T W where A has full rank, W = diag(1/u^2);  Cov(x) = A+ Cov(b) A+^T (eq. 6)
// Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace stepdiag {

// A row for each equation more than the rank: sums of equations whose left sides cancel, so that those of the right
// sides are noise. Of many equations rows are calculated when they are asked for: all would be the square of their
// number.
class Contradictions {
public:
    Contradictions() = default;
    // The factor Q of the weighted equations, as Householder vectors with their coefficients.
    Contradictions(Eigen::MatrixXd vectors, Eigen::VectorXd coefficients, Eigen::VectorXd weight, int rank);

    Eigen::Index rows() const { return weight_.size() - rank_; }
    // A number for each equation; `space` is where it may be.
    const double* row(Eigen::Index i, Eigen::VectorXd& space) const;
    Eigen::MatrixXd matrix() const;  // all of them

private:
    static constexpr Eigen::Index few = 100;
    void calculate(Eigen::Index i, Eigen::VectorXd& row) const;

    Eigen::MatrixXd vectors_;
    Eigen::VectorXd coefficients_, weight_;
    int rank_ = 0;
    Eigen::MatrixXd columns_;  // of few equations: the rows
};

struct LeastSquares {
    Eigen::MatrixXd
        pseudoinverse;  // A+, unknowns x equations; of minimum norm (columns scaled to 1) where rank is lacking
    int rank;
    // Unknown j is determined where e_j lies in the row space of A: no solution of A x = 0 has a part in it.
    std::vector<bool> determined;
    Contradictions contradictions = {};
};

// `standard_uncertainty`: one positive value an equation. Rank is decided on the weighted equations with columns scaled
// to length 1: pivots below 1e-9 of the largest count as zero.
LeastSquares solve_least_squares(const Eigen::MatrixXd& equations, const Eigen::VectorXd& standard_uncertainty);

}  // namespace stepdiag
