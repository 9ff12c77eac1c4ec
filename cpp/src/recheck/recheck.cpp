#include "stepdiag/recheck/recheck.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "evaluation/fit_test.hpp"
#include "recheck/prediction.hpp"
#include "recheck/same_machine.hpp"
#include "recheck/wrong_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// What the readings tell of the changes by their priors, everything else being estimated with them.
struct Told {
    Eigen::VectorXd information;  // of each direction, ascending: 1 is as much as the priors tell
    Eigen::MatrixXd direction;    // a column each
    Eigen::VectorXd estimate;     // along it, 0 where there is no information
    Eigen::Index first;           // from here on they tell more than the priors
};

// By the normal equations at the estimate with priors, which draw it towards 0 along each direction.
Told told_of_changes(const Prediction& prediction, Eigen::Index begin, Eigen::Index count) {
    const Eigen::MatrixXd information = prediction.information(begin, count);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(information);
    const Eigen::VectorXd drawn = parts.eigenvectors().transpose() * prediction.values().segment(begin, count);
    Told told{parts.eigenvalues(), parts.eigenvectors(), Eigen::VectorXd::Zero(count), count};
    for (Eigen::Index k = count; k-- > 0 && told.information[k] >= 1.0;) {
        told.first = k;
        told.estimate[k] = drawn[k] * (1.0 + told.information[k]) / told.information[k];
    }
    return told;
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

Judgement<Recheck> rechecked(const AdjustmentProblem& problem, const Baseline& changing, bool update) {
    const auto count = Eigen::Index(changing.changes().size());
    const Eigen::Index begin = changing.root().cols() - count;

    Prediction changed(problem, changing);
    changed.solve();
    const Told told = told_of_changes(changed, begin, count);

    Recheck result{0.0,
                   0,
                   1.0,
                   0.0,
                   0,
                   1.0,
                   changing.changes(),
                   {},
                   {},
                   {},
                   update ? with_change(changing, changed) : changing.calibration()};
    result.chi_square = told.estimate.cwiseAbs2().dot(told.information);
    result.degrees_of_freedom = int(count - told.first);
    if (result.degrees_of_freedom > 0)
        result.probability = chi_square_probability(result.chi_square, result.degrees_of_freedom);
    const ChiSquare fit = changed.fit(changing.own_columns(), changing.root().cols() - changing.own_columns());
    result.fit_chi_square = fit.square_sum;
    result.fit_degrees_of_freedom = fit.freedom;
    if (fit.freedom > 0) result.fit_probability = chi_square_probability(fit.square_sum, fit.freedom);
    Eigen::VectorXd prior(count);
    for (Eigen::Index j = 0; j < count; ++j) prior[j] = changing.changes()[std::size_t(j)].prior;
    result.covariance =
        prior.asDiagonal() * changed.covariance_columns(begin, count).middleRows(begin, count) * prior.asDiagonal();
    result.shape = changing.root().rightCols(count) * prior.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd strong = told.direction.rightCols(count - told.first);
    for (Eigen::Index j = 0; j < count; ++j) {
        ChangeTerm& term = result.terms[std::size_t(j)];
        term.value = prior[j] * changed.values()[begin + j];
        term.standard_uncertainty = std::sqrt(result.covariance(j, j));
        term.determined = strong.row(j).squaredNorm();
    }
    for (Eigen::Index k = count; k-- > told.first;) {
        ChangeCombination sum{{}, told.estimate[k], 1.0 / std::sqrt(told.information[k])};
        for (Eigen::Index j = 0; j < count; ++j) sum.weight.push_back(told.direction(j, k));
        result.combinations.push_back(std::move(sum));
    }
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
    if (!(0.0 < alpha && alpha < power && power < 1.0))
        throw InvalidArgument("alpha, power: expected probabilities, 0 < alpha < power < 1");
    constexpr double rounding = 1e-6;  // of a weight
    const double needed = noncentrality(int(recheck.combinations.size()), alpha, power);
    Eigen::VectorXd smallest(Eigen::Index(recheck.terms.size()));
    for (Eigen::Index j = 0; j < smallest.size(); ++j) {
        double by_prior = 0.0;  // noncentrality by the square of a change in units of its prior
        for (const ChangeCombination& sum : recheck.combinations)
            if (const double weight = sum.weight[std::size_t(j)]; std::abs(weight) > rounding)
                by_prior += std::pow(weight / sum.standard_uncertainty, 2);
        smallest[j] = recheck.terms[std::size_t(j)].prior * std::sqrt(needed / by_prior);
    }
    return smallest;
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
                const ChangePriors& priors, bool update) {
    check_same_machine(baseline, plan, chain, tool, options);
    AdjustmentProblem problem(measurement, plan, chain, tool, heads, of_known_machine(options));
    if (problem.readings().empty()) throw InvalidArgument("readings: all are lost");
    const Baseline changing(baseline, priors, read_positions(problem));
    return judge_without_wrong_readings(
        {measurement, plan, chain, tool, heads, options}, problem,
        [&](const AdjustmentProblem& rest) { return rechecked(rest, changing, update); });
}

}  // namespace stepdiag
