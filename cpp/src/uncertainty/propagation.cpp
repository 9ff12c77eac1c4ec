#include "stepdiag/uncertainty/propagation.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "stepdiag/core/error.hpp"
#include "uncertainty/contributions.hpp"

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
    std::map<int, std::vector<Index>> pooled;  // by estimate; negative: its own
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
            // Welch and Satterthwaite suppose independent estimates; a correlation of known uncertainties does not
            // matter.
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
    // Rounding of what cancels between correlated inputs may leave a variance below 0.
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
    // Rounded coefficients are welcome: what was printed to nine digits is one.
    constexpr double rounding = 1e-9;
    if (!correlation.allFinite() || (correlation - correlation.transpose()).cwiseAbs().maxCoeff() > rounding ||
        (correlation.diagonal().array() - 1.0).abs().maxCoeff() > rounding)
        throw InvalidArgument(what + ": expected a symmetric matrix of finite numbers with 1 on its diagonal");
    const Eigen::LDLT<MatrixXd> factor(correlation);
    if (factor.vectorD().minCoeff() < -rounding * double(size))
        throw InvalidArgument(what + ": expected a positive semidefinite matrix");
}

namespace {

void check_model(const LinearModel& model) {
    const Index n = Index(model.inputs.size());
    if (model.value.size() != Index(model.outputs.size()))
        throw InvalidArgument("value: expected " + std::to_string(model.outputs.size()) + " numbers, got " +
                              std::to_string(model.value.size()));
    if (model.sensitivity.rows() != model.value.size() || model.sensitivity.cols() != n)
        throw InvalidArgument("sensitivity: expected " + std::to_string(model.value.size()) + " x " +
                              std::to_string(n) + " numbers, a row each output, got " +
                              std::to_string(model.sensitivity.rows()) + " x " +
                              std::to_string(model.sensitivity.cols()));
    if (!model.sensitivity.allFinite() || !model.value.allFinite())
        throw InvalidArgument("value, sensitivity: expected finite numbers");
    std::map<int, double> estimates;
    for (const PropagatedInput& input : model.inputs) {
        if (!(std::isfinite(input.standard_uncertainty) && input.standard_uncertainty >= 0.0))
            throw InvalidArgument(input.name + ": expected a standard uncertainty of 0 or more");
        if (!(input.degrees_of_freedom > 0.0))
            throw InvalidArgument(input.name + ": expected degrees of freedom above 0");
        if (input.estimate < 0) continue;
        const auto [entry, is_new] = estimates.emplace(input.estimate, input.degrees_of_freedom);
        if (!is_new && entry->second != input.degrees_of_freedom)
            throw InvalidArgument(input.name + ": expected the degrees of freedom of the others of its estimate");
    }
    if (model.correlation.size() > 0) check_correlation(model.correlation, n, "correlation");
}

}  // namespace

Propagation propagate(const LinearModel& model, bool full_covariance) {
    check_model(model);
    VectorXd uncertainty(Index(model.inputs.size()));
    for (Index i = 0; i < uncertainty.size(); ++i) uncertainty[i] = model.inputs[std::size_t(i)].standard_uncertainty;
    const MatrixXd first_order = model.sensitivity * uncertainty.asDiagonal();
    Contributions sum(model.outputs, model.value, full_covariance);
    sum.add_inputs(model.inputs, first_order, MatrixXd::Zero(first_order.rows(), first_order.cols()),
                   model.correlation);
    return sum.result();
}

VectorXd Propagation::expanded(double coverage) const {
    if (!(coverage > 0.0 && coverage < 1.0))
        throw InvalidArgument("coverage: expected a probability between 0 and 1, got " + std::to_string(coverage));
    VectorXd expanded(value.size());
    for (Index i = 0; i < value.size(); ++i) {
        const double nu = degrees_of_freedom[i];
        // Rounding must not take 9 for 8.
        const double whole = std::isfinite(nu) ? std::max(std::floor(nu * (1.0 + 1e-12)), std::min(nu, 1.0)) : nu;
        expanded[i] = std::isnan(nu) ? nu : t_quantile((1.0 + coverage) / 2.0, whole) * standard_uncertainty[i];
    }
    return expanded;
}

VectorXd Propagation::second_order_shift() const {
    const VectorXd shift = second_order.rowwise().sum();
    return knows_products ? VectorXd(shift + product_shift) : shift;
}

VectorXd Propagation::second_order_uncertainty() const {
    VectorXd variance = standard_uncertainty.cwiseAbs2() + 2.0 * second_order.rowwise().squaredNorm();
    if (knows_products) variance += product_variance;
    return variance.cwiseSqrt();
}

}  // namespace stepdiag
