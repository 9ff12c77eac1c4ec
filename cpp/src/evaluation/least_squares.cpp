#include "stepdiag/evaluation/least_squares.hpp"

#include <Eigen/QR>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

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
    const Eigen::MatrixXd rotation = decomposition.householderQ();
    result.contradictions = rotation.rightCols(rotation.cols() - result.rank).transpose() * weight.asDiagonal();
    result.pseudoinverse = scale.asDiagonal() * inverse * weight.asDiagonal();
    return result;
}

}  // namespace stepdiag
