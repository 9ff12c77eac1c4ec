// Sums of products of deviations, for the covariance of all outputs. Internal.
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace stepdiag {

// Lower triangle of the sum over samples of (y - mean)(y - mean)^T; rows of values are outputs, `stride` apart.
// m^2 / 2 multiplications a sample for m outputs.
Eigen::MatrixXd outer_products(const double* values, std::size_t stride, std::size_t samples,
                               const Eigen::VectorXd& mean);

}  // namespace stepdiag
