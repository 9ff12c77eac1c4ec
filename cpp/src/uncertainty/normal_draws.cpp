#include "uncertainty/normal_draws.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/block_product.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Index panel = 48;  // columns of the triangular root that are multiplied at once

static_assert(NormalDraws::together % 6 == 0 && NormalDraws::together % Index(lane_group) == 0);

}  // namespace

NormalDraws::NormalDraws(const MatrixXd& covariance, std::uint64_t seed) : seed_(seed) {
    const Index n = covariance.rows();
    // Scale by the standard uncertainties, so that the order of the pivots does not depend on the units mm and rad.
    const VectorXd u = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const VectorXd inverse = (u.array() > 0.0).select(u.array().inverse(), 0.0);
    const Eigen::LDLT<MatrixXd> factor(inverse.asDiagonal() * covariance * inverse.asDiagonal());
    const VectorXd d = factor.vectorD().cwiseMax(0.0);
    // The pivots descend. Those that are rounding add nothing.
    rank_ = n;
    while (rank_ > 1 && d[rank_ - 1] <= 1e-15 * d[0]) --rank_;
    root_ = MatrixXd::Zero(n + widest_vector, rank_);
    root_.topRows(n) = -(MatrixXd(factor.matrixL()).leftCols(rank_) * d.head(rank_).cwiseSqrt().asDiagonal());
    Eigen::VectorXi order = Eigen::VectorXi::LinSpaced(int(n), 0, int(n) - 1);
    order = factor.transpositionsP() * order;
    place_.assign(order.begin(), order.end());
    scale_.resize(n);
    for (Index i = 0; i < n; ++i) scale_[i] = u[order[i]];
}

void NormalDraws::draw(std::uint64_t first, MatrixXd& columns) const {
    const Index n = scale_.size();
    const std::size_t pairs = std::size_t(rank_ + 1) / 2;
    MatrixXd numbers(together, 2 * Index(pairs));
    fill_normal({seed_, RandomStream::monte_carlo, first, std::size_t(together)}, pairs, numbers.data());
    MatrixXd product = MatrixXd::Zero(n + widest_vector, together);
    for (Index k = 0; k < rank_; k += panel)
        subtract_product(n - k, together, std::min(panel, rank_ - k), {&root_(k, k), root_.rows()},
                         {&numbers(0, k), 1, numbers.rows()}, {&product(k, 0), product.rows()});
    columns.resize(n, together);
    for (Index s = 0; s < together; ++s)
        for (Index i = 0; i < n; ++i) columns(place_[std::size_t(i)], s) = scale_[i] * product(i, s);
}

}  // namespace stepdiag
