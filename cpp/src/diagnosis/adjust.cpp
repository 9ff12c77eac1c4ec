#include "stepdiag/diagnosis/adjust.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/considered.hpp"
#include "adjustment/smoothness.hpp"
#include "diagnosis/fault_cost.hpp"
#include "diagnosis/prior_scatter.hpp"
#include "diagnosis/reliability.hpp"
#include "diagnosis/said_faults.hpp"
#include "diagnosis/verdict.hpp"
#include "diagnosis/weighed_run.hpp"
#include "evaluation/fit_test.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

void check_options(const AdjustmentOptions& options, const Plan& plan) {
    if (!(options.outlier_probability >= 0.0 && options.outlier_probability <= 0.5))
        throw InvalidArgument("adjustment outlier_probability: expected a probability from 0 to 0.5");
    if (const auto& s = options.smoothness)
        for (const auto& [key, value] : {std::pair("translation", s->translation), std::pair("rotation", s->rotation)})
            if (!(value == 0.0 || (value >= 1e-9 && value <= 1e6)))
                throw InvalidArgument(std::string("smoothness ") + key +
                                      ": expected 0 or a deviation of 1e-9 to 1e6 mm or rad");
    if (const auto& drift = options.machine_drift) {
        const auto& known = {"time",          "temperature",   "temperature_x",
                             "temperature_y", "temperature_z", "air_temperature"};
        if (std::find(known.begin(), known.end(), drift->record) == known.end())
            throw InvalidArgument("adjustment machine_drift: expected time or a temperature, got \"" + drift->record +
                                  "\"");
        if (!drift->standard_uncertainty.allFinite() || drift->standard_uncertainty.minCoeff() < 0.0)
            throw InvalidArgument("adjustment machine_drift: expected three finite standard uncertainties, at least 0");
    }
    for (const auto& [key, u] : {std::pair("distance_scale_uncertainty", options.distance_scale_uncertainty),
                                 std::pair("air_index_uncertainty", options.air_index_uncertainty)})
        if (!(u >= 0.0 && u < 1.0))
            throw InvalidArgument(std::string("adjustment ") + key + ": expected a part of at least 0 and below 1");
    for (const auto& entry : options.setup_by_line)
        if (!plan.contains(Line::parse(entry.first)))
            throw InvalidArgument("adjustment: line \"" + entry.first + "\" is not in the plan");
}

std::vector<KnownCombination> known_combinations(const Observability& observability, const Eigen::VectorXd& x,
                                                 const BorderedBand& inverse) {
    std::vector<KnownCombination> known;
    for (const auto& [form, combination] : observability.combinations()) {
        known.push_back(combination);
        known.back().value = form.value(x);
        known.back().standard_uncertainty = std::sqrt(std::max(0.0, form.variance(inverse)));
    }
    return known;
}

// A wrong coefficient makes lines that are measured at other temperatures grow otherwise, as faults do, which cost less
// than a coefficient far from its prior. Where the readings fit as well without the faults that were found, it is the
// coefficient.
std::vector<FitReason> coefficients_in_place_of_faults(const AdjustmentProblem& of_all,
                                                       const AdjustmentOptions& options, const Adjustment& found) {
    if (of_all.coefficients().empty() || found.faults.empty()) return {};
    Solution without(of_all, smoothness_at_start(options));
    if (!without.solve_from_zero()) return {};
    double of_readings = without.square_sum();
    for (const CoefficientUnknown& of : of_all.coefficients())
        of_readings -= std::pow(without.x()[of.unknown] / of.prior, 2);
    if (of_readings > found.weighted_square_sum + thresholds.fault * std::max(1.0, found.variance_factor())) return {};
    return far_coefficients(expansion_estimates(without.problem(), without.x(), without.inverse()),
                            drift_estimates(without.problem(), without.x(), without.inverse()));
}

std::vector<ReadingResidual> residuals_by_row(const NormalEquations& equations, const Eigen::VectorXd& variances) {
    std::vector<ReadingResidual> residuals = reading_residuals(equations, variances);
    const auto is_before = [](const ReadingResidual& a, const ReadingResidual& b) { return a.row < b.row; };
    if (!std::is_sorted(residuals.begin(), residuals.end(), is_before))
        std::stable_sort(residuals.begin(), residuals.end(), is_before);
    return residuals;
}

// The calibration at these values of the unknowns, were nothing left out or freed.
Calibration without_treatment(const Solution& treated, const AdjustmentProblem& plain,
                              const AdjustmentOptions& options) {
    Solution solution(plain, smoothness_at_start(options));
    solution.linearise(treated.x().head(plain.size()));
    return make_calibration(plain, solution.tables(), choose_forms(solution.tables()), solution.x(),
                            solution.inverse());
}

// Rms of the residuals, each in units of its rounding, or of where the solver stops.
double residual_rounding(const NormalEquations& equations) {
    constexpr double stops = 1e-6;  // of a standard uncertainty: no instrument is so much better than was stated
    double sum = 0.0;
    Eigen::Index r = 0;
    for (const AdjustedReading& reading : equations.problem().readings()) {
        const double u = reading.standard_uncertainty;
        sum += std::pow(equations.residuals()[r++] * u / std::max(reading.rounding, stops * u), 2);
    }
    return std::sqrt(sum / double(r));
}

[[noreturn]] void refuse_unsolved(const Measurement& measurement, const Plan& plan) {
    const std::string far = far_reading(measurement, plan);
    throw InvalidArgument("adjustment: " + (!far.empty() ? far
                                                         : "finds no machine and set-up that explain the readings; "
                                                           "check the plan, the head, and units and signs of the "
                                                           "readings"));
}

}  // namespace

Adjustment adjust(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                  const HeadCalibrations& heads, const AdjustmentOptions& options) {
    check_options(options, plan);
    check(options.plausible);
    const AdjustmentProblem of_all(measurement, plan, chain, tool, heads, options);
    if (of_all.readings().empty())
        throw InvalidArgument("adjustment: nothing can be determined: the run has no readings that count");
    refuse_foreign_distances(measurement, plan);

    WeighedRun found = weigh_and_find_faults(of_all, options);
    if (!found.state) refuse_unsolved(measurement, plan);
    const std::shared_ptr<Solution>& solution = found.state->solution;
    const AdjustmentProblem& problem = solution->problem();
    const Observability& observability = solution->observability();
    GaussNewton& solver = solution->solver();
    Adjustment result{{"", chain, {}, {}, {}, {}}, {}, {}, 0.0, 0, 1.0, 0, {}, smoothness_at_start(options)};
    result.iterations = solution->iterations();
    if (options.smoothness && options.smoothness->cross_validated) {
        result.smoothness = cross_validate(solver, solution->x(), options);
        solution->solve_again();
    }

    const Eigen::VectorXd& x = solution->x();
    const BorderedBand& inverse = solution->inverse();
    const CalibratedForms forms = choose_forms(solution->tables());
    result.calibration = make_calibration(problem, solution->tables(), forms, x, inverse);
    const std::vector<bool> known = known_unknowns(problem, observability.determined(), inverse);
    result.calibration.findings = observability.findings(known);
    if (!is_anything_determined(result.calibration)) throw NothingDetermined("adjustment", result.calibration.findings);
    result.faults = said_faults(*found.faults, *found.state, forms, measurement);
    refuse_implausible(result.calibration, measurement, plan, options.plausible);
    if (options.full_covariance) add_covariance(problem, forms, solver.factor(), result.calibration);
    result.setup = setup_estimates(problem, known, x, inverse);
    result.expansion = expansion_estimates(problem, x, inverse);
    result.machine_drift = drift_estimates(problem, x, inverse);
    result.rounded = problem.rounded();
    result.residuals = residuals_by_row(solver.equations(), solution->reading_variances());
    std::vector<ReadingResidual> found_by_noise;
    const ResidualsByNoise by_noise = [&]() -> const std::vector<ReadingResidual>& {
        if (found_by_noise.empty())
            found_by_noise = residuals_by_row(solver.equations(),
                                              solution->reading_variances() + solver.equations().prior_shares(inverse));
        return found_by_noise;
    };
    for (const ScatterOfChannel& each : found.scatter) result.variance_components.push_back(each.component);
    result.combinations = known_combinations(observability, x, inverse);
    result.weighted_square_sum = solver.equations().square_sum(x);
    result.degrees_of_freedom = solution->degrees_of_freedom();
    if (result.degrees_of_freedom > 0)
        result.chi_square_probability = chi_square_probability(result.weighted_square_sum, result.degrees_of_freedom);
    const auto patterns = residual_patterns(result, by_noise, measurement, solver.equations(), solver.factor());
    result.verdict = judge(result, patterns, prior_scatter(problem, x, solver.factor()),
                           less_noise(result.residuals, by_noise), residual_rounding(solver.equations()));
    if (!result.faults.empty())
        take_costs(costs_of_faults(result.calibration, without_treatment(*solution, *found.problem, options)),
                   result.verdict);
    if (!solution->is_minimum()) {
        const double factor = std::sqrt(result.variance_factor());
        result.verdict = {Fit::rejected, {{FitFinding::noise_factor, factor, thresholds.largest_noise_factor}}};
    }
    for (const FitReason& reason : coefficients_in_place_of_faults(of_all, options, result)) {
        result.verdict.fit = Fit::rejected;
        result.verdict.reasons.push_back(reason);
    }
    const double noise = std::sqrt(std::max(1.0, result.variance_factor()));
    result.unseen = unseen_faults(*solution, *tests_now(*found.faults, *found.state)->tests, forms, noise);
    if (options.reliability) result.reliability = reliability(*solution, forms, noise);
    if (options.scale_uncertainty) scale_uncertainties(result);
    add_deviation_effects(deviation_effects(solver, options), problem, forms, observability, result);
    state_temperature(measurement, options.expansion, result.calibration);
    for (const ExpansionEstimate& found : result.expansion)
        for (const int axis : found.axes) (*result.calibration.expansion)[axis] = found.value;
    state_verdict(result);
    if (result.degrees_of_freedom > 0) result.calibration.variance_factor = result.variance_factor();
    return result;
}

}  // namespace stepdiag
