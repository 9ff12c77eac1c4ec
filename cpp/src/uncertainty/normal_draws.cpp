#include "uncertainty/normal_draws.hpp"

#include <cmath>

#include "stepdiag/core/random.hpp"

namespace stepdiag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

PivotedRoot::PivotedRoot(const MatrixXd& covariance) {
    // Scale by the standard uncertainties, so that the order of the pivots does not depend on the units mm and rad.
    const VectorXd u = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const VectorXd inverse = (u.array() > 0.0).select(u.array().inverse(), 0.0);
    const Eigen::LDLT<MatrixXd> factor(inverse.asDiagonal() * covariance * inverse.asDiagonal());
    const VectorXd d = factor.vectorD().cwiseMax(0.0);
    // The pivots descend. Those that are rounding add nothing.
    rank = d.size();
    while (rank > 1 && d[rank - 1] <= 1e-15 * d[0]) --rank;
    lower = MatrixXd(factor.matrixL()).leftCols(rank) * d.head(rank).cwiseSqrt().asDiagonal();
    Eigen::VectorXi order = Eigen::VectorXi::LinSpaced(int(u.size()), 0, int(u.size()) - 1);
    order = factor.transpositionsP() * order;
    place.assign(order.begin(), order.end());
    scale.resize(u.size());
    for (Index i = 0; i < u.size(); ++i) scale[i] = u[order[i]];
}

MatrixXd normal_root(const MatrixXd& covariance) {
    const PivotedRoot root(covariance);
    MatrixXd matrix(root.lower.rows(), root.rank);
    for (Index i = 0; i < matrix.rows(); ++i)
        matrix.row(root.place[std::size_t(i)]) = root.scale[i] * root.lower.row(i);
    return matrix;
}

MatrixXd normal_numbers(std::uint64_t seed, std::uint64_t first_sample, Index count, Index samples) {
    MatrixXd numbers(count, samples);
    for (Index s = 0; s < samples; ++s)
        for (Index i = 0; i < count; i += 2) {
            const auto pair =
                normal_pair(seed, RandomStream::monte_carlo, {first_sample + std::uint64_t(s), std::uint32_t(i / 2)});
            numbers(i, s) = pair[0];
            if (i + 1 < count) numbers(i + 1, s) = pair[1];
        }
    return numbers;
}

}  // namespace stepdiag
