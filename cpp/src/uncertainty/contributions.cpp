#include "uncertainty/contributions.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Contributions::Contributions(std::vector<SampleModel::Output> outputs, VectorXd value, bool full_covariance)
    : full_covariance_(full_covariance) {
    const Index n = value.size();
    sum_.outputs = std::move(outputs);
    sum_.value = std::move(value);
    variance_ = satterthwaite_ = sum_.between_groups = VectorXd::Zero(n);
    sum_.first_order = sum_.second_order = MatrixXd::Zero(n, 0);
    if (full_covariance) sum_.covariance = MatrixXd::Zero(n, n);
}

VectorXd& Contributions::group_variance(const std::string& group) {
    const auto found = std::find(groups_.begin(), groups_.end(), group);
    if (found != groups_.end()) return group_variances_[std::size_t(found - groups_.begin())];
    groups_.push_back(group);
    return group_variances_.emplace_back(VectorXd::Zero(variance_.size()));
}

void Contributions::add_estimate(const VectorXd& variance, double degrees_of_freedom) {
    satterthwaite_ += variance.cwiseAbs2() / degrees_of_freedom;
}

void Contributions::add(const std::string& group, const MatrixXd& effect, double degrees_of_freedom) {
    const VectorXd variance = effect.rowwise().squaredNorm();
    variance_ += variance;
    group_variance(group) += variance;
    add_estimate(variance, degrees_of_freedom);
    if (full_covariance_) sum_.covariance.selfadjointView<Eigen::Lower>().rankUpdate(effect);
}

void Contributions::add_covariance(const std::string& group, const MatrixXd& covariance) {
    variance_ += covariance.diagonal();
    group_variance(group) += covariance.diagonal();
    if (full_covariance_) sum_.covariance += covariance;
}

void Contributions::add_inputs(const std::vector<PropagatedInput>& inputs, const MatrixXd& first_order,
                               const MatrixXd& second_order, const MatrixXd& correlation) {
    sum_.inputs = inputs;
    sum_.first_order = first_order;
    sum_.second_order = second_order;
    const bool correlated = correlation.size() > 0;
    const Index count = Index(inputs.size());
    std::map<int, std::vector<Index>> pooled;  // by estimate; a negative key means a separate estimate
    for (Index i = 0; i < count; ++i) {
        const int estimate = inputs[std::size_t(i)].estimate;
        pooled[estimate < 0 ? -1 - int(i) : estimate].push_back(i);
        VectorXd& group = group_variance(inputs[std::size_t(i)].group);
        group += first_order.col(i).cwiseAbs2();
        variance_ += first_order.col(i).cwiseAbs2();
        for (Index j = 0; correlated && j < count; ++j) {
            if (j == i || correlation(i, j) == 0.0) continue;
            const VectorXd covariance = correlation(i, j) * first_order.col(i).cwiseProduct(first_order.col(j));
            const bool together = inputs[std::size_t(i)].group == inputs[std::size_t(j)].group;
            (together ? group : sum_.between_groups) += covariance;
            variance_ += covariance;
            // The Welch-Satterthwaite formula requires independent estimates. Correlations of inputs with exactly known
            // uncertainties are irrelevant.
            if (std::isfinite(inputs[std::size_t(i)].degrees_of_freedom))
                satterthwaite_ = (covariance.array() != 0.0)
                                     .select(VectorXd::Constant(variance_.size(), std::nan("")), satterthwaite_);
        }
    }
    for (const auto& [estimate, members] : pooled) {
        VectorXd variance = VectorXd::Zero(variance_.size());
        for (const Index i : members) variance += first_order.col(i).cwiseAbs2();
        add_estimate(variance, inputs[std::size_t(members.front())].degrees_of_freedom);
    }
    if (full_covariance_) {
        const MatrixXd root = correlated ? MatrixXd(first_order * correlation) : first_order;
        sum_.covariance += root * first_order.transpose();
    }
}

Propagation Contributions::result() const {
    Propagation result = sum_;
    // Contributions of correlated inputs may cancel; rounding can then make a variance negative.
    result.standard_uncertainty = variance_.cwiseMax(0.0).cwiseSqrt();
    result.degrees_of_freedom =
        (satterthwaite_.array() == 0.0)
            .select(std::numeric_limits<double>::infinity(), variance_.array().square() / satterthwaite_.array());
    result.groups = groups_;
    result.budget.resize(variance_.size(), Index(groups_.size()));
    for (std::size_t g = 0; g < groups_.size(); ++g)
        result.budget.col(Index(g)) = group_variances_[g].cwiseMax(0.0).cwiseSqrt();
    if (full_covariance_) result.covariance = MatrixXd(sum_.covariance.selfadjointView<Eigen::Lower>());
    return result;
}

void check_correlation(const MatrixXd& correlation, Index size, const std::string& what) {
    const std::string shape = std::to_string(size);
    if (correlation.rows() != size || correlation.cols() != size)
        throw InvalidArgument(what + ": expected " + shape + " x " + shape + " numbers, got " +
                              std::to_string(correlation.rows()) + " x " + std::to_string(correlation.cols()));
    // Accepts coefficients rounded to nine digits.
    constexpr double rounding = 1e-9;
    if (!correlation.allFinite() || (correlation - correlation.transpose()).cwiseAbs().maxCoeff() > rounding ||
        (correlation.diagonal().array() - 1.0).abs().maxCoeff() > rounding)
        throw InvalidArgument(what + ": expected a symmetric matrix of finite numbers with 1 on its diagonal");
    const Eigen::LDLT<MatrixXd> factor(correlation);
    if (factor.vectorD().minCoeff() < -rounding * double(size))
        throw InvalidArgument(what + ": expected a positive semidefinite matrix");
}

}  // namespace stepdiag
