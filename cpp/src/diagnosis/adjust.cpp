#include "stepdiag/diagnosis/adjust.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/considered.hpp"
#include "adjustment/smoothness.hpp"
#include "diagnosis/fault_cost.hpp"
#include "diagnosis/fault_search.hpp"
#include "diagnosis/prior_scatter.hpp"
#include "diagnosis/reliability.hpp"
#include "diagnosis/said_faults.hpp"
#include "diagnosis/variance_components.hpp"
#include "diagnosis/verdict.hpp"
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

using SolutionPointer = std::shared_ptr<Solution>;

SolutionPointer solved(const AdjustmentProblem& problem, const AdjustmentOptions& options) {
    auto solution = std::make_shared<Solution>(problem, smoothness_at_start(options));
    return solution->solve_from_zero() ? solution : nullptr;
}

// Where nobody will use what comes out: a second's worth.
SolutionPointer solved_soon(const AdjustmentProblem& problem, const AdjustmentOptions& options) {
    constexpr int least_soon = 40, work = 40'000, rough = 10;
    const int soon = std::clamp(work / problem.size(), least_soon, GaussNewton::usual_most_steps);
    auto solution = std::make_shared<Solution>(problem, smoothness_at_start(options));
    return solution->solve_from_zero(soon) || solution->go_from_zero(rough) ? solution : nullptr;
}

using Scatter = std::vector<ScatterOfChannel>;

bool is_odd(const Scatter& scatter) {
    return std::any_of(scatter.begin(), scatter.end(),
                       [](const ScatterOfChannel& each) { return each.probability < odd_scatter; });
}

bool is_noise(const Scatter& scatter) {
    return std::all_of(scatter.begin(), scatter.end(), [](const ScatterOfChannel& each) { return each.is_noise; });
}

bool is_beyond_credible(const std::vector<NoiseFactor>& noise) {
    return std::any_of(noise.begin(), noise.end(),
                       [](const NoiseFactor& each) { return each.factor > thresholds.largest_noise_factor; });
}

// A run with its readings weighed by some noise, and adjusted with what was done about faults.
struct Weighed {
    Weighed(const AdjustmentProblem& of_all, const AdjustmentOptions& options, std::vector<NoiseFactor> with)
        : noise(std::move(with)) {
        auto weighed = std::make_shared<AdjustmentProblem>(of_all);
        weighed->weigh(noise);
        problem = weighed;
        plain = options.search_faults ? solved(*problem, options) : solved_soon(*problem, options);
        if (plain) state = FaultState{{}, plain};
        faults = std::make_shared<FaultContext>(*problem, options, smoothness_at_start(options), plain);
    }
    // What another look at the scatter says of the noise.
    std::vector<NoiseFactor> look() {
        scatter = scatter_of_channels(*state->solution, noise);
        return to_weigh(scatter);
    }
    void find_faults() {
        state = search_faults(*faults);
        if (has_faults()) look();
    }
    bool has_faults() const { return state && state->solution != plain; }

    std::vector<NoiseFactor> noise;
    std::shared_ptr<const AdjustmentProblem> problem;  // to which the next one refers
    std::shared_ptr<const FaultContext> faults;
    std::shared_ptr<Solution> plain;  // with nothing done about faults; none where no minimum is reached
    std::optional<FaultState> state;
    Scatter scatter;
};

// Distances that are taken for far better than they are decide what tilts have to say, so that nothing controls them
// any more. Taken for far worse, they show their scatter: the factor that they come down to, or none.
std::vector<NoiseFactor> noise_of_loose_distances(const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    constexpr int most_rounds = 10;
    constexpr double loose = 1000.0, at_once = 0.1;  // what tilts do to distances hides a scatter that is far below
    std::vector<NoiseFactor> noise{{"distance", "", loose}};
    for (int round = 0; round < most_rounds; ++round) {
        AdjustmentProblem problem = of_all;
        problem.weigh(noise);
        const SolutionPointer solution = solved(problem, options);
        if (!solution) break;
        std::vector<NoiseFactor> next;
        for (const ScatterOfChannel& each : scatter_of_channels(*solution, noise))
            if (each.component.noise.channel == "distance" && each.component.noise.line.empty())
                next.push_back(each.component.noise);
        if (next.empty()) break;
        double& factor = next.front().factor;
        factor = std::max(factor, at_once * noise.front().factor);
        if (factor <= 1.0) break;
        if (are_alike(noise, next)) return next;
        noise = next;
    }
    return {};
}

// The run with each channel weighed by its own noise, and the faults that stand out of that.
Weighed weigh_by_noise(const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    constexpr int most_rounds = 6, most_searches = 3;
    Weighed run(of_all, options, noise_of_loose_distances(of_all, options));
    for (int round = 0; round < most_rounds && run.plain; ++round) {
        std::vector<NoiseFactor> next = run.look();
        if (are_alike(run.noise, next)) break;
        run = Weighed(of_all, options, std::move(next));
    }
    for (int search = 0; run.plain; ++search) {
        run.find_faults();
        if (!run.has_faults() || search == most_searches) break;
        std::vector<NoiseFactor> next = to_weigh(run.scatter);
        if (are_alike(run.noise, next)) break;
        run = Weighed(of_all, options, std::move(next));
    }
    return run;
}

// Whether priors of set-ups that are far too narrow explain the scatter: without them there is none.
bool priors_explain(const Weighed& run, const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    if (!run.state) return false;
    Solution& at = *run.state->solution;
    AdjustmentProblem problem = of_all;
    std::set<SetupQuantity> far;
    for (const LineSetup& setup : of_all.setups())
        for (const int c : setup.active) {
            const int j = setup.unknown[c];
            const double u = std::sqrt(element(at.inverse(), j, j)), prior = setup.prior[c];
            if (std::isfinite(prior) && distance_from_prior(at.x()[j], u, prior) > thresholds.farthest_prior)
                far.insert(setup::component(c).quantity);
        }
    if (far.empty()) return false;
    for (const SetupQuantity quantity : far) problem.free_set_up(quantity);
    const SolutionPointer solution = solved(problem, options);
    return solution && !is_odd(scatter_of_channels(*solution, {}));
}

// Scatter comes before faults. Where some channel scatters more than stated, a few faults may explain all of it. If
// they do not, and it is noise, the readings are weighed with that, and faults are sought as far as they stand out of
// it; beyond what is credible it is noise alone.
Weighed find(const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    Weighed run(of_all, options, {});
    if (!options.search_faults) return run;
    if (run.plain && options.variance_components) run.look();
    const bool may_be_noise = options.variance_components && (!run.plain || is_odd(run.scatter));
    run.find_faults();
    if (!may_be_noise || (run.has_faults() && !is_odd(run.scatter)) || priors_explain(run, of_all, options)) return run;
    Weighed by_noise = weigh_by_noise(of_all, options);
    if (by_noise.noise.empty() || !by_noise.plain || !by_noise.state) return run;
    if (is_beyond_credible(by_noise.noise)) by_noise.state = FaultState{{}, by_noise.plain};
    by_noise.look();
    return is_noise(by_noise.scatter) ? by_noise : run;
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

    Weighed found = find(of_all, options);
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
    result.residuals = reading_residuals(solver.equations(), solution->reading_variances());
    std::stable_sort(result.residuals.begin(), result.residuals.end(),
                     [](const ReadingResidual& a, const ReadingResidual& b) { return a.row < b.row; });
    for (const ScatterOfChannel& each : found.scatter) result.variance_components.push_back(each.component);
    result.combinations = known_combinations(observability, x, inverse);
    result.weighted_square_sum = solver.equations().square_sum(x);
    result.degrees_of_freedom = solution->degrees_of_freedom();
    if (result.degrees_of_freedom > 0)
        result.chi_square_probability = chi_square_probability(result.weighted_square_sum, result.degrees_of_freedom);
    const auto patterns = residual_patterns(result, measurement, solver.equations(), solver.factor());
    result.verdict =
        judge(result, patterns, prior_scatter(problem, x, solver.factor()), residual_rounding(solver.equations()));
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
    result.calibration.fit = result.verdict.fit;
    if (result.degrees_of_freedom > 0) result.calibration.variance_factor = result.variance_factor();
    return result;
}

}  // namespace stepdiag
