#include "evaluation/least_squares.hpp"

#include <Eigen/QR>
#include <cmath>
#include <utility>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

Contradictions::Contradictions(Eigen::MatrixXd vectors, Eigen::VectorXd coefficients, Eigen::VectorXd weight, int rank)
    : vectors_(std::move(vectors)), coefficients_(std::move(coefficients)), weight_(std::move(weight)), rank_(rank) {
    if (weight_.size() > few) return;
    columns_.resize(weight_.size(), rows());
    Eigen::VectorXd row;
    for (Eigen::Index i = 0; i < rows(); ++i) {
        calculate(i, row);
        columns_.col(i) = row;
    }
}

void Contradictions::calculate(Eigen::Index i, Eigen::VectorXd& row) const {
    row.setZero(weight_.size());
    row[rank_ + i] = 1.0;
    row.applyOnTheLeft(Eigen::householderSequence(vectors_, coefficients_));
    row.array() *= weight_.array();
}

const double* Contradictions::row(Eigen::Index i, Eigen::VectorXd& space) const {
    if (columns_.size() > 0) return columns_.col(i).data();
    calculate(i, space);
    return space.data();
}

Eigen::MatrixXd Contradictions::matrix() const {
    Eigen::MatrixXd all(rows(), weight_.size());
    Eigen::VectorXd row;
    for (Eigen::Index i = 0; i < rows(); ++i) {
        calculate(i, row);
        all.row(i) = row.transpose();
    }
    return all;
}

LeastSquares solve_least_squares(const Eigen::MatrixXd& equations, const Eigen::VectorXd& standard_uncertainty) {
    constexpr double rank_threshold = 1e-9;
    constexpr double in_row_space = 1e-6;  // of the projector's diagonal, which is 1 or clearly smaller
    if (standard_uncertainty.size() != equations.rows() || !equations.allFinite() ||
        !standard_uncertainty.allFinite() || !(standard_uncertainty.array() > 0.0).all())
        throw InvalidArgument(
            "least squares: expected finite equations and one positive standard uncertainty for each");
    const Eigen::Index unknowns = equations.cols();
    LeastSquares result{Eigen::MatrixXd::Zero(unknowns, equations.rows()), 0, std::vector<bool>(unknowns, false)};
    if (equations.rows() == 0) return result;

    const Eigen::VectorXd weight = standard_uncertainty.minCoeff() * standard_uncertainty.cwiseInverse();
    const Eigen::MatrixXd weighted = weight.asDiagonal() * equations;
    const Eigen::VectorXd scale =
        weighted.colwise().norm().transpose().unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 1.0; });
    const Eigen::MatrixXd scaled = weighted * scale.asDiagonal();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(rank_threshold);
    decomposition.compute(scaled);
    const Eigen::MatrixXd inverse = decomposition.pseudoInverse();
    result.rank = int(decomposition.rank());
    const Eigen::VectorXd projector = inverse.cwiseProduct(scaled.transpose()).rowwise().sum();
    for (Eigen::Index j = 0; j < unknowns; ++j) result.determined[j] = projector[j] > 1.0 - in_row_space;
    result.contradictions = {decomposition.matrixQTZ(), decomposition.hCoeffs(), weight, result.rank};
    result.pseudoinverse = scale.asDiagonal() * inverse * weight.asDiagonal();
    return result;
}

}  // namespace stepdiag
