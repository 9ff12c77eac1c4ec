#include "diagnosis/prior_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "adjustment/normal_equations.hpp"
#include "evaluation/fit_test.hpp"
#include "stepdiag/measurement/setup_quantity.hpp"

namespace stepdiag {
namespace {

// That a sum of eigenvalue times chi-square(1) is larger than T: by the chi-square of the same first three moments (P.
// Hall, J. Roy. Statist. Soc. B 45 (1983) 393). `sums`: of the eigenvalues, their squares and their cubes.
double upper_tail(double t, const std::array<double, 3>& sums) {
    const double freedom = std::pow(sums[1], 3) / std::pow(sums[2], 2);
    const double standard = (t - sums[0]) / std::sqrt(2.0 * sums[1]);
    const double square = std::max(0.0, freedom + standard * std::sqrt(2.0 * freedom));
    return chi_square_probability(square, freedom);
}

}  // namespace

std::vector<ResidualPattern> prior_scatter(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                           const BorderedFactor& factor) {
    constexpr double told = 1e-3;      // of all values' variance; below it second order and rounding may be as much
    constexpr std::size_t most = 500;  // values: time grows with the third power
    struct Value {
        int unknown;
        double prior;
    };
    std::map<SetupQuantity, std::vector<Value>> by_quantity;
    for (const LineSetup& setup : problem.setups())
        for (const int column : setup.active) {
            const SetupQuantity quantity = setup::component(column).quantity;
            const double prior = setup.prior[column];
            if (is_adjusted(quantity) && prior < record(quantity).broadest)
                by_quantity[quantity].push_back({setup.unknown[column], prior});
        }
    std::vector<ResidualPattern> found;
    for (const auto& [quantity, values] : by_quantity) {
        if (values.size() > most) continue;
        const Eigen::Index count = Eigen::Index(values.size());
        Eigen::MatrixXd m(count, count);
        double t = 0.0, squares = 0.0;
        for (const Value& value : values) {
            t += std::pow(x[value.unknown] / value.prior, 2);
            squares += value.prior * value.prior;
        }
        for (Eigen::Index first = 0; first < count; first += BorderedFactor::sides) {
            const Eigen::Index end = std::min<Eigen::Index>(count, first + BorderedFactor::sides);
            BorderedFactor::Sides covariance = BorderedFactor::Sides::Zero(x.size(), BorderedFactor::sides);
            for (Eigen::Index i = first; i < end; ++i) covariance(values[std::size_t(i)].unknown, i - first) = 1.0;
            factor.solve(covariance);
            for (Eigen::Index i = first; i < end; ++i)
                for (Eigen::Index j = 0; j <= i; ++j) {
                    const Value &a = values[std::size_t(i)], &b = values[std::size_t(j)];
                    m(j, i) = m(i, j) = (i == j ? 1.0 : 0.0) - covariance(b.unknown, i - first) / (a.prior * b.prior);
                }
        }
        const Eigen::MatrixXd square = m * m;
        const std::array<double, 3> sums{m.trace(), square.trace(), square.cwiseProduct(m).sum()};
        if (!(sums[0] > told * double(count)) || !(sums[2] > 0.0)) continue;
        const double usual = std::sqrt(squares / double(count));
        const double factor = std::sqrt(std::max(0.0, 1.0 + (t - sums[0]) / sums[1]));
        found.push_back({{FitFinding::prior_scatter, factor * usual, usual, "", name(quantity)}, upper_tail(t, sums)});
    }
    for (ResidualPattern& pattern : found)
        pattern.probability = std::min(1.0, double(found.size()) * pattern.probability);
    return found;
}

}  // namespace stepdiag
