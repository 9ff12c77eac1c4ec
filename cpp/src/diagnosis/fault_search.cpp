#include "diagnosis/fault_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/fault_class.hpp"

namespace stepdiag {
namespace {

using namespace search_limits;

// Its steps: each takes a state and returns the next one, or none where there is none.
class Search {
public:
    explicit Search(const FaultContext& context) : context_(context) {}

    std::optional<FaultState> run() const;

private:
    using SolutionPointer = FaultContext::SolutionPointer;

    std::optional<FaultState> without_gross(const SolutionPointer& all) const;
    std::optional<FaultState> found_linearly(const SolutionPointer& where, const SolutionPointer& before) const;
    FaultState find_more(FaultState state) const;
    std::optional<FaultState> with_fewer(const FaultState& state) const;
    bool is_too_much(const FaultState& state, const std::optional<FaultCandidate>& worst) const;
    std::optional<FaultState> with_more(const FaultState& state, const FaultCandidate& fault) const;
    std::optional<FoundFaults> revised(const FaultState& state) const;
    FaultState correct(FaultState state) const;
    std::optional<FaultState> treat(const FaultState& state, FoundFaults classes) const;
    FaultState with_left(FaultState state) const;
    // With these faults instead; none where no minimum is reached.
    std::optional<FaultState> near(const FaultState& state, const FoundFaults& found) const {
        SolutionPointer solution = context_.solve_near(found, *state.solution);
        return solution ? std::optional(FaultState{found, solution}) : std::nullopt;
    }

    const FaultContext& context_;
};

std::optional<FaultState> Search::run() const {
    const AdjustmentOptions& options = context_.options;
    const bool corrects = options.outlier_probability > 0.0;
    const SolutionPointer& all = context_.all;  // 1
    std::optional<FaultState> state;
    if (corrects) state = without_gross(all);  // 2
    if (!state && all) state = FaultState{{}, all};
    if (!state) return state;
    if (corrects) state = correct(*state);  // 3 to 9
    if (corrects && !state->gave_up && state->found.empty()) return state;
    return with_left(state->gave_up && all ? FaultState{{}, all} : *state);  // 10
}

// None where readings do not scatter so much, or where that helps nothing.
std::optional<FaultState> Search::without_gross(const SolutionPointer& all) const {
    if (all && !(all->scatter() > thresholds.gross_scatter)) return std::nullopt;
    std::optional<FaultState> open = found_linearly(nullptr, all);
    if (!open) return std::nullopt;
    if (auto again = found_linearly(open->solution, open->solution)) open = again;
    FoundFaults told;
    for (int k = 0; k < int(open->found.size()); ++k)
        if (const auto found = class_of_one_more(context_, without(open->found, k), *open->solution))
            told = with(told, found->members.front());
    const auto next = near(*open, told);
    return next ? next : open;
}

// On the problem linearised there (none: at zero), each with all that it may be instead, and then where that leads.
// What second order leaves counts as scatter: faults are sought as far as they stand out of it. None where there are
// none, or too many, or where more is left than `before`.
std::optional<FaultState> Search::found_linearly(const SolutionPointer& where, const SolutionPointer& before) const {
    const auto test = [&](const FoundFaults& found) {
        return where ? context_.test_near(found, *where) : context_.test(context_.unsolved(found));
    };
    FoundFaults found;
    while (true) {
        const TestedFaults rest = test(found);
        const auto next = context_.worst(rest);
        if (!next) break;
        if (rest.is_hopeless(next->score.gain, context_.left_of_all(found))) return std::nullopt;
        found = with(found, *next);
    }
    FoundFaults open;
    for (int k = 0; k < int(found.size()); ++k) {
        const TestedFaults rest = test(without(found, k));
        if (!context_.worst(rest)) continue;  // beside the others it is none
        const std::vector<int> order = rest.order();
        const double best = rest.tests->scores()[order.front()].gain, behind = rest.behind(best);
        FoundFault all{{}, FaultHandling::open};
        for (const int h : order)
            if (all.members.size() < most_members && best - rest.tests->scores()[h].gain < behind)
                all.members.push_back(rest.candidate(h));
        open.push_back(std::move(all));
    }
    if (open.empty()) return std::nullopt;
    const SolutionPointer next = context_.unsolved(open);
    // Where that leaves as much, it is no faults of readings.
    if (!(next->solve_from_zero() && next->scatter() <= thresholds.gross_scatter)) return std::nullopt;
    if (!(next->square_sum() < (before ? before : next)->square_sum() * same_minimum)) return std::nullopt;
    return FaultState{open, next};
}

FaultState Search::find_more(FaultState state) const {
    // Sound runs need no limit.
    for (int step = 0; step == 0 || step < steps_a_fault * context_.most_of_all(); ++step) {
        while (const auto fewer = with_fewer(state)) state = *fewer;                  // 3
        state.tests = std::make_shared<TestedFaults>(context_.test(state.solution));  // 4
        const auto worst = context_.worst(*state.tests);
        if (is_too_much(state, worst)) break;                               // 5
        const auto more = worst ? with_more(state, *worst) : std::nullopt;  // 6 and 7
        if (!more) return state;
        state = *more;
    }
    state.gave_up = true;
    return state;
}

// A tilt's first reading that is wrong, and a slip after it, are the same to first order; what second order makes of
// the one that did not happen looks like a fault of distances.
std::optional<FaultState> Search::with_fewer(const FaultState& state) const {
    const FaultHypotheses& hypotheses = context_.hypotheses;
    const double square_sum = state.solution->square_sum();
    for (int k = 0; k < int(state.found.size()); ++k) {
        const FaultCandidate& own = state.found[k].members.front();
        const FaultHypothesis tested = hypotheses.as_tested(own.hypothesis);
        if (own.score.gain < thresholds.second_order || !hypotheses.differs_from_slip(tested)) continue;
        FaultCandidate other = own;
        other.hypothesis = own.hypothesis == tested ? *hypotheses.as_slip(tested) : tested;
        other.score.size = -own.score.size;
        FoundFaults exchanged = state.found;
        exchanged[k] = {{other}};
        for (int j = 0; j < int(state.found.size()); ++j) {
            if (j == k) continue;
            auto next = near(state, without(exchanged, j));
            const double enough = context_.limit * scatter_factor(square_sum, state.solution->degrees_of_freedom());
            if (next && next->solution->square_sum() < square_sum + enough) return next;
        }
    }
    return std::nullopt;
}

// A scatter that nobody believes and no fault explains: then the many that were found explain nothing either.
bool Search::is_too_much(const FaultState& state, const std::optional<FaultCandidate>& worst) const {
    const TestedFaults& tests = *state.tests;
    if (!worst)
        return (!state.found.empty() && context_.are_too_many(state.found)) ||
               (int(state.found.size()) > few && !(tests.noise_beside(0.0) <= thresholds.largest_variance_factor()));
    const int on_the_way = context_.left_of(context_.channel(*worst), state.found) + more_on_the_way;
    return on_the_way <= 0 ||
           tests.is_hopeless(worst->score.gain, std::max(on_the_way, context_.left_of_all(state.found)));
}

std::optional<FaultState> Search::with_more(const FaultState& state, const FaultCandidate& fault) const {
    std::optional<FaultState> more = near(state, with(state.found, fault));
    if (!more)
        if (const auto found = class_of_one_more(context_, state.found, *state.solution))
            more = near(state, with(state.found, found->members.front()));
    const auto found = more ? revised(*more) : std::nullopt;
    return found ? near(*more, *found) : more;
}

// Beside those that were found later, an earlier one may be none, or another one. None where all stay.
std::optional<FoundFaults> Search::revised(const FaultState& state) const {
    FoundFaults found = state.found;
    if (found.size() < 2 || found.size() > most_revised) return std::nullopt;
    bool changed = false;
    for (int k = 0; k + 1 < int(found.size());) {
        const TestedFaults tested = context_.test_near(without(found, k), *state.solution);
        const auto best = context_.worst(tested);
        if (!best) {
            found = without(found, k);
            changed = true;
            continue;
        }
        const FaultHypothesis own = tested.hypotheses->as_tested(found[k].members.front().hypothesis);
        if (!(best->score.gain - tested.gain_of(own) < tested.behind(best->score.gain))) {
            found[k] = {{*best}};
            changed = true;
        }
        ++k;
    }
    return changed ? std::optional(found) : std::nullopt;
}

FaultState Search::correct(FaultState state) const {
    const auto is_last = [&](int round) { return round + 1 >= rounds_more + context_.most_of_all(); };
    for (int round = 0; round == 0 || !is_last(round - 1); ++round) {
        state = find_more(state);  // 3 to 7
        if (state.gave_up || state.found.empty()) return state;
        FoundFaults classes;  // 8
        std::optional<int> none;
        for (int k = 0; k < int(state.found.size()); ++k) {
            const auto found = class_of_one_more(context_, without(state.found, k), *state.solution);
            if (found) classes.push_back(*found);
            else none = k;
        }
        if (none) {
            const auto next = near(state, without(state.found, *none));
            if (!next) return state;
            state = *next;
            continue;
        }
        auto treated = treat(state, classes);  // 9
        if (!treated) return state;
        treated->single = state.solution;
        const auto left = context_.worst(context_.test(treated->solution));
        if (!left || is_last(round) || context_.left_of(context_.channel(*left), classes) <= 0) return *treated;
        const auto next = near(state, with(state.found, *left));
        if (!next) return *treated;
        state = *next;
    }
    return state;
}

std::optional<FaultState> Search::treat(const FaultState& state, FoundFaults classes) const {
    const Solution& before = *state.solution;
    const double expected = same_minimum * before.square_sum() + treated_cost * double(classes.size());
    const auto solve = [&]() -> std::optional<FaultState> {
        // From zero where that leads as far: as if the readings left out had been lost.
        for (const bool from_zero : {true, false}) {
            const SolutionPointer next = context_.unsolved(classes);
            const bool solved =
                from_zero ? next->solve_from_zero() : next->solve_from(context_.carried(before, next->problem()));
            if (solved && next->square_sum() <= expected) return FaultState{classes, next};
        }
        return std::nullopt;
    };
    if (const auto next = solve()) return next;
    // Gross alternatives that no one solution stands between: all of them are free then.
    for (FoundFault& found : classes)
        if (found.handling == FaultHandling::shared) found.handling = FaultHandling::open;
    return solve();
}

FaultState Search::with_left(FaultState state) const {
    state.tests.reset();
    state.left = class_of_one_more(context_, state.found, *state.solution);
    return state;
}

}  // namespace

std::optional<FaultState> search_faults(const FaultContext& context) { return Search(context).run(); }

std::shared_ptr<const TestedFaults> tests_now(const FaultContext& context, const FaultState& state) {
    const bool solved_again = context.options.smoothness && context.options.smoothness->cross_validated;
    if (state.tests && !solved_again) return state.tests;
    Solution& solution = *state.solution;
    TestedFaults tested{state.solution, std::make_unique<FaultHypotheses>(solution.problem())};
    tested.tests = std::make_unique<FaultTests>(solution.solver().equations(), solution.solver().factor(),
                                                solution.inverse(), solution.reading_variances(), *tested.hypotheses);
    return std::make_shared<TestedFaults>(std::move(tested));
}

}  // namespace stepdiag
