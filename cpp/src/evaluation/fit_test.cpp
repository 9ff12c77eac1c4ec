#include "evaluation/fit_test.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/SpecialFunctions>

namespace stepdiag {
namespace {

// Where a function that rises from below to above 0 is 0.
template <class Function>
double rising_root(const Function& function) {
    double low = 0.0, high = 1.0;
    while (function(high) < 0.0) high *= 2.0;
    while (high - low > 1e-12 * high) {
        const double middle = 0.5 * (low + high);
        (function(middle) < 0.0 ? low : high) = middle;
    }
    return high;
}

// The probability of a larger square sum if its mean is not 0: a mixture of central ones, by Poisson's probabilities.
double noncentral_probability(double square_sum, double freedom, double noncentrality) {
    const double mean = 0.5 * noncentrality;
    const int most = int(mean + 12.0 * std::sqrt(mean) + 40.0);
    double sum = 0.0;
    for (int k = 0; k <= most; ++k)
        sum += std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0)) *
               chi_square_probability(square_sum, freedom + 2.0 * k);
    return sum;
}

}  // namespace

double chi_square_probability(double square_sum, double freedom) {
    return Eigen::numext::igammac(0.5 * freedom, 0.5 * square_sum);
}

double noncentrality(int freedom, double alpha, double power) {
    if (freedom < 1) return std::numeric_limits<double>::infinity();
    const double limit = rising_root([&](double x) { return alpha - chi_square_probability(x, freedom); });
    return rising_root([&](double x) { return noncentral_probability(limit, freedom, x) - power; });
}

Fit fit_of_noise(double square_sum, int freedom) {
    if (freedom <= 0) return Fit::unchecked;
    if (!(std::sqrt(square_sum / freedom) <= thresholds.largest_noise_factor)) return Fit::rejected;
    const double probability = chi_square_probability(square_sum, freedom);
    return probability >= thresholds.misfit_doubtful && probability <= thresholds.no_misfit_doubtful ? Fit::accepted
                                                                                                     : Fit::doubtful;
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
