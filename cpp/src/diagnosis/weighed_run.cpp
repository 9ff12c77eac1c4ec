#include "diagnosis/weighed_run.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "adjustment/smoothness.hpp"
#include "diagnosis/verdict.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

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
WeighedRun weigh_by_noise(const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    constexpr int most_rounds = 6, most_searches = 3;
    WeighedRun run(of_all, options, noise_of_loose_distances(of_all, options));
    for (int round = 0; round < most_rounds && run.plain; ++round) {
        std::vector<NoiseFactor> next = run.look();
        if (are_alike(run.noise, next)) break;
        run = WeighedRun(of_all, options, std::move(next));
    }
    for (int search = 0; run.plain; ++search) {
        run.find_faults();
        if (!run.has_faults() || search == most_searches) break;
        std::vector<NoiseFactor> next = to_weigh(run.scatter);
        if (are_alike(run.noise, next)) break;
        run = WeighedRun(of_all, options, std::move(next));
    }
    return run;
}

// Whether priors of set-ups that are far too narrow explain the scatter: without them there is none.
bool priors_explain(const WeighedRun& run, const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
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

}  // namespace

WeighedRun::WeighedRun(const AdjustmentProblem& of_all, const AdjustmentOptions& options, std::vector<NoiseFactor> with)
    : noise(std::move(with)) {
    auto weighed = std::make_shared<AdjustmentProblem>(of_all);
    weighed->weigh(noise);
    problem = weighed;
    plain = options.search_faults ? solved(*problem, options) : solved_soon(*problem, options);
    if (plain) state = FaultState{{}, plain};
    faults = std::make_shared<FaultContext>(*problem, options, smoothness_at_start(options), plain);
}

std::vector<NoiseFactor> WeighedRun::look() {
    scatter = scatter_of_channels(*state->solution, noise);
    return to_weigh(scatter);
}

bool WeighedRun::is_explained_by_faults() const {
    if (!has_faults()) return false;
    return !is_odd(scatter_of_channels(state->single ? *state->single : *state->solution, noise));
}

void WeighedRun::find_faults() {
    state = search_faults(*faults);
    if (has_faults()) look();
}

WeighedRun weigh_and_find_faults(const AdjustmentProblem& of_all, const AdjustmentOptions& options) {
    WeighedRun run(of_all, options, {});
    if (!options.search_faults) return run;
    if (run.plain && options.variance_components) run.look();
    const bool may_be_noise = options.variance_components && (!run.plain || is_odd(run.scatter));
    run.find_faults();
    if (!may_be_noise || run.is_explained_by_faults() || priors_explain(run, of_all, options)) return run;
    WeighedRun by_noise = weigh_by_noise(of_all, options);
    if (by_noise.noise.empty() || !by_noise.plain || !by_noise.state) return run;
    if (is_beyond_credible(by_noise.noise)) by_noise.state = FaultState{{}, by_noise.plain};
    by_noise.look();
    return is_noise(by_noise.scatter) ? by_noise : run;
}

}  // namespace stepdiag
