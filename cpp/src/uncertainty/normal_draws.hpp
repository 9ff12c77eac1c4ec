// Draws from the joint normal distribution of a calibration's values. Internal.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace stepdiag {

// covariance = A A^T with row place[i] of A = scale[i] * row i of `lower`, which is zero above its diagonal. The
// covariance may be singular, because exactly known values (0 at home) have no variance: `lower` has `rank` columns.
struct PivotedRoot {
    explicit PivotedRoot(const Eigen::MatrixXd& covariance);

    Eigen::MatrixXd lower;
    std::vector<Eigen::Index> place;
    Eigen::VectorXd scale;
    Eigen::Index rank;
};

// The same as one matrix A.
Eigen::MatrixXd normal_root(const Eigen::MatrixXd& covariance);

// Standard normal numbers; each column is one sample.
Eigen::MatrixXd normal_numbers(std::uint64_t seed, std::uint64_t first_sample, Eigen::Index count,
                               Eigen::Index samples);

}  // namespace stepdiag
