#include "evaluation/fit_test.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace stepdiag {

double chi_square_probability(double square_sum, double freedom) {
    return Eigen::numext::igammac(0.5 * freedom, 0.5 * square_sum);
}

Fit fit_of_noise(double square_sum, int freedom) {
    if (freedom <= 0) return Fit::unchecked;
    if (!(std::sqrt(square_sum / freedom) <= largest_noise_factor)) return Fit::rejected;
    const double probability = chi_square_probability(square_sum, freedom);
    return probability >= doubtful_below && probability <= doubtful_above ? Fit::accepted : Fit::doubtful;
}

ChiSquare chi_square(const Eigen::VectorXd& values, const Eigen::MatrixXd& covariance) {
    constexpr double rank_threshold = 1e-9;  // relative to correlations
    if (values.size() == 0) return {0.0, 0};
    const Eigen::VectorXd scale =
        covariance.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
    const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * covariance * scale.asDiagonal());
    Eigen::VectorXd rest = factor.transpositionsP() * Eigen::VectorXd(scale.cwiseProduct(values));
    factor.matrixL().solveInPlace(rest);
    ChiSquare test{0.0, 0};
    for (Eigen::Index i = 0; i < rest.size(); ++i) {
        const double pivot = factor.vectorD()[i];
        if (!(pivot > rank_threshold)) continue;
        test.square_sum += rest[i] * rest[i] / pivot;
        ++test.freedom;
    }
    return test;
}

ShareSum::ShareSum(Eigen::Index size) : sum_(Eigen::MatrixXd::Zero(size, size)), shares_(size, 64) {}

void ShareSum::flush() {
    if (count_ > 0 && sum_.size() > 0) sum_.selfadjointView<Eigen::Lower>().rankUpdate(shares_.leftCols(count_));
    count_ = 0;
}

const Eigen::MatrixXd& ShareSum::matrix() {
    flush();
    sum_ = Eigen::MatrixXd(sum_.selfadjointView<Eigen::Lower>());
    return sum_;
}

}  // namespace stepdiag
