#include "recheck/baseline.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "recheck/told_changes.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Where the slope of a function is not determined, it is taken to be known to this: no machine has more.
constexpr double usual_slope = 1e-3;  // mm/mm

struct Interval {
    std::size_t node;  // its lower end
    double share;      // of its upper end
};

// Constant beyond the ends, as interpolate() has it.
Interval find(const std::vector<double>& nodes, double position) {
    if (position <= nodes.front()) return {0, 0.0};
    if (position >= nodes.back()) return {nodes.size() - 1, 0.0};
    const auto after = std::upper_bound(nodes.begin(), nodes.end(), position);
    const auto k = std::size_t(after - nodes.begin()) - 1;
    return {k, (position - nodes[k]) / (nodes[k + 1] - nodes[k])};
}

double interpolated(const std::vector<double>& values, const Interval& at) {
    return at.share == 0.0 ? values[at.node] : (1.0 - at.share) * values[at.node] + at.share * values[at.node + 1];
}

void check_complete(const Calibration& calibration) {
    std::string missing;
    const auto miss = [&](const std::string& name) { missing += (missing.empty() ? "" : ", ") + name; };
    for (int i = 0; i < function_count; ++i)
        if (!calibration.functions[i]) miss(FunctionId::at(i).name());
    for (const Squareness s : all_squarenesses)
        if (!calibration.squarenesses[static_cast<int>(s)]) miss(name(s));
    if (!missing.empty())
        throw InvalidArgument("calibration: does not determine " + missing +
                              "; readings can be predicted only where all 21 parameters are known");
    if (calibration.covariance.size() == 0)
        throw InvalidArgument(
            "calibration: has no covariance, so that predictions have no uncertainty; evaluate its run with the full "
            "covariance, and keep it as netCDF");
}

}  // namespace

Baseline::Baseline(Calibration calibration, const ChangePriors& priors, const Positions& read)
    : calibration_(std::move(calibration)) {
    check(calibration_);
    check_complete(calibration_);
    int entry = 0;
    for (int i = 0; i < function_count; ++i) {
        first_entry_[i] = entry;
        entry += int(calibration_.functions[i]->position.size());
    }
    for (int s = 0; s < squareness_count; ++s) first_entry_[function_count + s] = entry++;
    find_root(read_entries(read));
    for (const double prior : {priors.scale, priors.bow, priors.slope, priors.squareness})
        if (!(std::isfinite(prior) && prior >= 0.0))
            throw InvalidArgument("change: expected priors that are finite and at least 0");
    const auto add = [&](const std::string& parameter, ChangeKind kind, double prior) {
        if (prior > 0.0) add_change({parameter, kind, 0.0, prior, prior});
    };
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (id.is_positioning()) add(id.name(), ChangeKind::scale, priors.scale);
        else if (id.is_straightness()) add(id.name(), ChangeKind::bow, priors.bow);
        else add(id.name(), ChangeKind::slope, priors.slope);
    }
    for (const Squareness s : all_squarenesses) add(name(s), ChangeKind::squareness, priors.squareness);
    if (changes_.empty()) throw InvalidArgument("change: expected a prior above 0 for one kind of change at least");
}

// Those with an uncertainty: functions are 0 at home, and the frame takes three straightnesses to 0 at the end.
std::vector<int> Baseline::read_entries(const Positions& read) const {
    std::vector<bool> is_read(std::size_t(calibration_.covariance.rows()), false);
    for (int i = 0; i < function_count; ++i)
        for (const double position : read[index(FunctionId::at(i).axis)]) {
            const Interval at = find(calibration_.functions[i]->position, position);
            is_read[std::size_t(first_entry_[i]) + at.node] = true;
            if (at.share > 0.0) is_read[std::size_t(first_entry_[i]) + at.node + 1] = true;
        }
    for (int s = 0; s < squareness_count; ++s) is_read[std::size_t(first_entry_[function_count + s])] = true;
    std::vector<int> entries;
    for (int k = 0; k < int(is_read.size()); ++k)
        if (is_read[std::size_t(k)] && calibration_.covariance(k, k) > 0.0) entries.push_back(k);
    return entries;
}

// With the correlations of what is read, P^T L D L^T P: their root, and for all others the part that goes with them.
void Baseline::find_root(const std::vector<int>& entries) {
    const Eigen::MatrixXd& covariance = calibration_.covariance;
    const auto count = Eigen::Index(entries.size()), all = covariance.rows();
    Eigen::MatrixXd columns(all, count);
    for (Eigen::Index j = 0; j < count; ++j) {
        const int entry = entries[std::size_t(j)];
        columns.col(j) = covariance.col(entry) / std::sqrt(covariance(entry, entry));
    }
    Eigen::MatrixXd correlations(count, count);
    for (Eigen::Index i = 0; i < count; ++i) {
        const int entry = entries[std::size_t(i)];
        correlations.row(i) = columns.row(entry) / std::sqrt(covariance(entry, entry));
    }
    const Eigen::LDLT<Eigen::MatrixXd> factor(correlations);
    Eigen::MatrixXd shares = factor.transpositionsP() * columns.transpose();
    factor.matrixL().solveInPlace(shares);
    constexpr double rounding = 1e-12;  // of a correlation of 1: what depends on others altogether
    std::vector<int> open;
    for (int i = 0; i < function_count; ++i)
        if (!calibration_.functions[i]->slope_determined) open.push_back(i);
    root_.setZero(all, count + Eigen::Index(open.size()));
    own_columns_ = 0;
    for (Eigen::Index k = 0; k < count; ++k)
        if (const double pivot = factor.vectorD()[k]; pivot > rounding)
            root_.col(own_columns_++) = shares.row(k).transpose() / std::sqrt(pivot);
    for (std::size_t k = 0; k < open.size(); ++k) {
        const std::vector<double>& nodes = calibration_.functions[open[k]]->position;
        for (std::size_t n = 0; n < nodes.size(); ++n)
            root_(first_entry_[open[k]] + int(n), own_columns_ + Eigen::Index(k)) = usual_slope * nodes[n];
    }
    root_.conservativeResize(Eigen::NoChange, own_columns_ + Eigen::Index(open.size()));
}

Eigen::MatrixXd Baseline::rest_covariance() const {
    const auto own = root_.leftCols(own_columns_);
    return calibration_.covariance - own * own.transpose();
}

Eigen::MatrixXd Baseline::shape() const {
    return root_.rightCols(Eigen::Index(changes_.size())) * priors_of(changes_).cwiseInverse().asDiagonal();
}

void Baseline::add_change(const ChangeTerm& change) {
    root_.conservativeResize(Eigen::NoChange, root_.cols() + 1);
    auto column = root_.col(root_.cols() - 1);
    column.setZero();
    changes_.push_back(change);
    if (const auto squareness = parse_squareness(change.parameter)) {
        column[first_entry_[function_count + static_cast<int>(*squareness)]] = change.prior;
        return;
    }
    const FunctionId id = *FunctionId::parse(change.parameter);
    const std::vector<double>& nodes = calibration_.functions[id.index()]->position;
    const double travel = calibration_.volume[index(id.axis)];
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const double share = nodes[k] / travel;
        column[first_entry_[id.index()] + Eigen::Index(k)] =
            change.prior * (change.kind == ChangeKind::scale ? nodes[k]
                            : change.kind == ChangeKind::bow ? 4.0 * share * (1.0 - share)
                                                             : share);
    }
}

AxisErrors Baseline::errors(Axis axis, double position, bool negative, std::vector<Share>& shares) const {
    AxisErrors errors = AxisErrors::Zero();
    for (int c = 0; c < 6; ++c) {
        const int i = FunctionId{axis, Component(c)}.index();
        const CalibratedFunction& function = *calibration_.functions[i];
        const Interval at = find(function.position, position);
        errors[c] = interpolated(function.value, at);
        shares.push_back({first_entry_[i] + int(at.node), c, 1.0 - at.share});
        if (at.share > 0.0) shares.push_back({first_entry_[i] + int(at.node) + 1, c, at.share});
        if (const auto& reversal = calibration_.reversal[i]; negative && reversal)
            errors[c] -= interpolated(reversal->value, find(reversal->position, position));
    }
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        if (term.axis != axis) continue;
        const int k = static_cast<int>(s);
        errors[term.component] += term.sign * position * calibration_.squarenesses[k]->value;
        shares.push_back({first_entry_[function_count + k], term.component, term.sign * position});
    }
    return errors;
}

bool Baseline::is_node(Axis axis, double position) const {
    constexpr double same = 1e-6;  // mm
    for (int c = 0; c < 6; ++c) {
        const auto& nodes = calibration_.functions[FunctionId{axis, Component(c)}.index()]->position;
        if (std::none_of(nodes.begin(), nodes.end(), [&](double node) { return std::abs(node - position) < same; }))
            return false;
    }
    return true;
}

}  // namespace stepdiag
