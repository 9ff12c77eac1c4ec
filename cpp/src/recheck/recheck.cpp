#include "stepdiag/recheck/recheck.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "evaluation/fit_test.hpp"
#include "recheck/prediction.hpp"
#include "recheck/same_machine.hpp"
#include "recheck/told_changes.hpp"
#include "recheck/wrong_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// By direction, 0 where there is no information: the priors draw what is found at the estimate with them towards 0.
Eigen::VectorXd estimate(const ToldChanges& told, const Eigen::VectorXd& found) {
    const Eigen::VectorXd drawn = told.direction.transpose() * found;
    Eigen::VectorXd estimate = Eigen::VectorXd::Zero(found.size());
    for (Eigen::Index k = told.first; k < found.size(); ++k)
        estimate[k] = drawn[k] * (1.0 + told.information[k]) / told.information[k];
    return estimate;
}

Calibration with_change(const Baseline& baseline, const Prediction& prediction) {
    const Eigen::MatrixXd& root = baseline.root();
    const Eigen::Index columns = root.cols();
    const Eigen::VectorXd change = root * prediction.values().head(columns);
    const Eigen::MatrixXd inverse = prediction.covariance_columns(0, columns);
    const Eigen::MatrixXd covariance = baseline.rest_covariance() + root * inverse.topRows(columns) * root.transpose();
    Calibration updated = baseline.calibration();
    updated.method += (updated.date.empty() ? "" : " of " + updated.date) + ", rechecked";
    updated.date.clear();
    updated.conditions.clear();  // of the first evaluation, as the next two
    updated.budget.clear();
    updated.uncertainty_parts.clear();
    updated.covariance = 0.5 * (covariance + covariance.transpose());
    Eigen::Index entry = 0;
    const auto take = [&](double& value, double& uncertainty) {
        value += change[entry];
        uncertainty = std::sqrt(std::max(updated.covariance(entry, entry), 0.0));
        ++entry;
    };
    for (auto& function : updated.functions)
        for (std::size_t k = 0; k < function->value.size(); ++k)
            take(function->value[k], function->standard_uncertainty[k]);
    for (auto& squareness : updated.squarenesses) take(squareness->value, squareness->standard_uncertainty);
    return updated;
}

Judgement<Recheck> rechecked(const AdjustmentProblem& problem, const Baseline& changing) {
    const auto count = Eigen::Index(changing.changes().size());
    const Eigen::Index begin = changing.root().cols() - count;

    Prediction changed(problem, changing);
    changed.solve();
    const ToldChanges told(changed.information(begin, count));
    const Eigen::VectorXd found = estimate(told, changed.values().segment(begin, count));

    Recheck result{0.0, 0, 1.0, 0.0, 0, 1.0, changing.changes(), {}, {}, {}, with_change(changing, changed)};
    result.chi_square = found.cwiseAbs2().dot(told.information);
    result.degrees_of_freedom = int(count - told.first);
    if (result.degrees_of_freedom > 0)
        result.probability = chi_square_probability(result.chi_square, result.degrees_of_freedom);
    const ChiSquare fit = changed.fit(changing.own_columns(), changing.root().cols() - changing.own_columns());
    result.fit_chi_square = fit.square_sum;
    result.fit_degrees_of_freedom = fit.freedom;
    if (fit.freedom > 0) result.fit_probability = chi_square_probability(fit.square_sum, fit.freedom);
    const Eigen::VectorXd prior = priors_of(changing.changes());
    result.covariance =
        prior.asDiagonal() * changed.covariance_columns(begin, count).middleRows(begin, count) * prior.asDiagonal();
    result.shape = changing.shape();
    const Eigen::MatrixXd strong = told.direction.rightCols(count - told.first);
    for (Eigen::Index j = 0; j < count; ++j) {
        ChangeTerm& term = result.terms[std::size_t(j)];
        term.value = prior[j] * changed.values()[begin + j];
        term.standard_uncertainty = std::sqrt(result.covariance(j, j));
        term.determined = strong.row(j).squaredNorm();
    }
    result.combinations = told.combinations(found);
    constexpr std::size_t shown = 5;
    std::vector<Misfit> misfits;
    if (result.fit_probability < readings_asked_below) misfits = largest_misfits(problem, changed, shown);
    for (const Misfit& misfit : misfits) {
        const AdjustedReading& reading = problem.readings()[misfit.reading];
        result.misfits.push_back(
            {reading.row, problem.channel_name(reading), misfit.value, misfit.standard_uncertainty});
    }
    const bool is_asked = std::min(result.probability, result.fit_probability) < readings_asked_below;
    const double probability = result.fit_probability;
    return {std::move(result), fit, probability, is_asked, std::move(misfits), fit.square_sum, changed.missed()};
}

}  // namespace

Eigen::VectorXd smallest_changes_seen(const Recheck& recheck, double alpha, double power) {
    return smallest_changes(recheck.combinations, priors_of(recheck.terms), alpha, power);
}

std::string name(ChangeKind kind) {
    switch (kind) {
        case ChangeKind::scale: return "scale";
        case ChangeKind::bow: return "bow";
        case ChangeKind::slope: return "slope";
        default: return "squareness";
    }
}

Recheck recheck(const Calibration& baseline, const Measurement& measurement, const Plan& plan, const Chain& chain,
                const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options,
                const ChangePriors& priors) {
    AdjustmentProblem problem = problem_of_known_machine(baseline, measurement, plan, chain, tool, heads, options);
    const Baseline changing(baseline, priors, read_positions(problem));
    return judge_without_wrong_readings({measurement, plan, chain, tool, heads, options}, problem,
                                        [&](const AdjustmentProblem& rest) { return rechecked(rest, changing); });
}

}  // namespace stepdiag
