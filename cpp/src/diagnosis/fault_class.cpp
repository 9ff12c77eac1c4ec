#include "diagnosis/fault_class.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stepdiag {
namespace {

using namespace search_limits;
using Candidates = std::vector<FaultCandidate>;
constexpr double infinity = std::numeric_limits<double>::infinity();

FaultCandidate opposite(const FaultHypothesis& hypothesis, const FaultScore& score, bool is_name) {
    FaultCandidate candidate{hypothesis, score, is_name};
    candidate.score.size = -score.size;
    return candidate;
}

// Beside a tilt's first reading that may be wrong the slip that second order may tell from it.
Candidates with_slips(const FaultHypotheses& hypotheses, const Candidates& candidates) {
    Candidates all;
    for (const FaultCandidate& c : candidates) {
        all.push_back(c);
        if (hypotheses.differs_from_slip(c.hypothesis))
            all.push_back(opposite(*hypotheses.as_slip(c.hypothesis), c.score, false));
    }
    return all;
}

// Beside a first reading that may be wrong the slip that it may be named as, where nothing distinguishes them.
Candidates with_names(const FaultHypotheses& hypotheses, const Candidates& members, bool large) {
    Candidates all;
    for (const FaultCandidate& c : members) {
        all.push_back(c);
        const auto slip = hypotheses.as_slip(c.hypothesis);
        if (slip && !(large && hypotheses.differs_from_slip(c.hypothesis)))
            all.push_back(opposite(*slip, c.score, true));
    }
    return all;
}

// Those that are left, each with the gain and the size of an adjustment with it; those behind `most_exact` as they are.
Candidates adjusted_exactly(const FaultContext& context, const FoundFaults& others, const Solution& solution,
                            Candidates candidates) {
    double least = infinity, gain_of_least = candidates.front().score.gain;
    int freedom = 0;
    std::vector<double> square_sum;
    for (std::size_t i = 0; i < candidates.size() && i < most_exact; ++i) {
        const auto adjusted = context.unsolved(with(others, candidates[i]));
        square_sum.push_back(infinity);
        if (!adjusted->solve_from(context.carried(solution, adjusted->problem()))) continue;
        square_sum.back() = adjusted->square_sum();
        candidates[i].score.size = adjusted->x()[adjusted->problem().faults().back().unknown];
        if (square_sum.back() >= least) continue;
        least = square_sum.back();
        gain_of_least = candidates[i].score.gain;
        freedom = adjusted->degrees_of_freedom();
    }
    if (least == infinity) return candidates;
    const double behind = thresholds.alternative * scatter_factor(least, freedom);
    for (std::size_t i = 0; i < square_sum.size(); ++i)
        candidates[i].score.gain = gain_of_least + least - square_sum[i];
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [&](const FaultCandidate& c) { return !(gain_of_least - c.score.gain < behind); }),
                     candidates.end());
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const FaultCandidate& a, const FaultCandidate& b) { return a.score.gain > b.score.gain; });
    return candidates;
}

// Where second order tells the large fault of a reading from those of its twins, no reading controls these any more.
Candidates with_twins(Candidates members, const TestedFaults& tested) {
    const auto& all = tested.hypotheses->all();
    const auto best = std::find(all.begin(), all.end(), members.front().hypothesis);
    if (best == all.end() || best->kind != FaultKind::reading) return members;
    const std::vector<double> correlation = tested.tests->correlations(int(best - all.begin()));
    for (std::size_t h = 0; h < all.size(); ++h) {
        const auto is_this = [&](const FaultCandidate& member) { return member.hypothesis == all[h]; };
        if (all[h].kind != FaultKind::reading || std::abs(correlation[h]) < twin) continue;
        if (std::none_of(members.begin(), members.end(), is_this)) members.push_back(tested.candidate(int(h)));
    }
    return members;
}

// Readings that show the same in all others: without them nothing is left of the fault. One of the two of a scale line
// takes the other with it.
bool is_told_by_leaving_out(const FaultHypotheses& hypotheses, const Candidates& members, const TestedFaults& tested) {
    const auto& all = tested.hypotheses->all();
    std::vector<int> number;
    for (const FaultCandidate& member : members) {
        if (member.hypothesis.kind != FaultKind::reading) return false;
        if (hypotheses.sequences()[member.hypothesis.sequence].readings.size() < 3) return false;
        number.push_back(int(std::find(all.begin(), all.end(), member.hypothesis) - all.begin()));
    }
    for (std::size_t i = 0; i + 1 < number.size(); ++i) {
        const std::vector<double> correlation = tested.tests->correlations(number[i]);
        for (std::size_t j = i + 1; j < number.size(); ++j)
            if (std::abs(correlation[number[j]]) < twin) return false;
    }
    return true;
}

}  // namespace

std::optional<FoundFault> class_of_one_more(const FaultContext& context, const FoundFaults& others,
                                            const Solution& solution) {
    const FaultHypotheses& hypotheses = context.hypotheses;
    const TestedFaults tested = context.test_near(others, solution);
    if (!context.worst(tested)) return std::nullopt;
    const std::vector<int> order = tested.order();
    const double best = tested.tests->scores()[order.front()].gain;
    const bool large = best > thresholds.second_order;
    const double behind = tested.behind(best);
    Candidates members;
    for (const int h : order) {
        const double less = best - tested.tests->scores()[h].gain;
        const bool may_be = large && members.size() < most_exact && less < behind + second_order_part * best;
        if (members.size() < most_members && (less < behind || may_be)) members.push_back(tested.candidate(h));
    }
    if (large && tested.noise_beside(best) <= thresholds.largest_variance_factor()) {
        members = adjusted_exactly(context, others, solution, with_slips(hypotheses, members));
        const Candidates twins = with_twins(members, tested);
        if (is_told_by_leaving_out(hypotheses, twins, tested)) members = twins;
    }
    const bool leave_out = is_told_by_leaving_out(hypotheses, members, tested);
    return FoundFault{with_names(hypotheses, members, large),
                      leave_out ? FaultHandling::left_out : FaultHandling::shared};
}

}  // namespace stepdiag
