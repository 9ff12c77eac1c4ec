#include "recheck/told_changes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "evaluation/fit_test.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

ToldChanges::ToldChanges(const Eigen::MatrixXd& information) : first(information.rows()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(information);
    this->information = parts.eigenvalues();
    direction = parts.eigenvectors();
    while (first > 0 && this->information[first - 1] >= 1.0) --first;
}

std::vector<ChangeCombination> ToldChanges::combinations(const Eigen::VectorXd& estimate) const {
    std::vector<ChangeCombination> combinations;
    for (Eigen::Index k = information.size(); k-- > first;) {
        const auto weights = direction.col(k);
        combinations.push_back(
            {std::vector<double>(weights.begin(), weights.end()), estimate[k], 1.0 / std::sqrt(information[k])});
    }
    return combinations;
}

Eigen::VectorXd priors_of(const std::vector<ChangeTerm>& terms) {
    Eigen::VectorXd priors(Eigen::Index(terms.size()));
    std::transform(terms.begin(), terms.end(), priors.begin(), [](const ChangeTerm& term) { return term.prior; });
    return priors;
}

Eigen::VectorXd smallest_changes(const std::vector<ChangeCombination>& told, const Eigen::VectorXd& prior, double alpha,
                                 double power) {
    if (!(0.0 < alpha && alpha < power && power < 1.0))
        throw InvalidArgument("alpha, power: expected probabilities, 0 < alpha < power < 1");
    constexpr double rounding = 1e-6;  // of a weight
    const double needed = noncentrality(int(told.size()), alpha, power);
    Eigen::VectorXd smallest(prior.size());
    for (Eigen::Index j = 0; j < prior.size(); ++j) {
        double by_prior = 0.0;  // noncentrality by the square of a change in units of its prior
        for (const ChangeCombination& sum : told)
            if (const double weight = sum.weight[std::size_t(j)]; std::abs(weight) > rounding)
                by_prior += std::pow(weight / sum.standard_uncertainty, 2);
        smallest[j] = prior[j] * std::sqrt(needed / by_prior);
    }
    return smallest;
}

}  // namespace stepdiag
