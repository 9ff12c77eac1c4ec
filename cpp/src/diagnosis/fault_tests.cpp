#include "diagnosis/fault_tests.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace stepdiag {
namespace {

constexpr int none = -1;  // place

// Whether an unknown takes up a constant of the channel: the distance's own, a beam's, a spot's zero, the mirror's
// angle.
bool has_free_constant(const LineSetup& setup, int channel) {
    const auto is_free = [&](int column) {
        return setup.unknown[column] != no_unknown &&
               setup.prior[column] >= record(setup::component(column).quantity).broadest;
    };
    switch (setup.model.kind()) {
        case HeadLayout::ideal: return is_free(channel == 0 ? setup::distance_constant : setup::reflector);
        case HeadLayout::psd: return is_free(channel == 0 ? setup::distance_constant : setup::psd_zero);
        case HeadLayout::multi_beam: break;
    }
    if (channel > 0) return is_free(setup::beam_constants + channel);
    // All others have theirs against the first one.
    bool all_free = is_free(setup::distance_constant);
    for (int beam = 1; beam < setup.model.beams(); ++beam) all_free = all_free && is_free(setup::beam_constants + beam);
    return all_free;
}

}  // namespace

FaultScore::FaultScore(double s, double q) : standard_uncertainty(1.0 / std::sqrt(q)) {
    if (q == 0.0) return;
    size = s / q;
    gain = s * size;
}

std::vector<FaultScore> scores_of(const std::vector<const ReadingPattern*>& patterns, const NormalEquations& equations,
                                  const BorderedFactor& factor, double least_share) {
    const AdjustmentProblem& problem = equations.problem();
    std::vector<FaultScore> scores;
    while (scores.size() < patterns.size()) {
        const int count = int(std::min<std::size_t>(BorderedFactor::sides, patterns.size() - scores.size()));
        BorderedFactor::Sides gradients = BorderedFactor::Sides::Zero(problem.size(), BorderedFactor::sides);  // J^T c
        BorderedFactor::OfSides s = BorderedFactor::OfSides::Zero(), square = s;
        for (int side = 0; side < count; ++side) {
            const ReadingPattern& pattern = *patterns[scores.size() + std::size_t(side)];
            for (std::size_t k = 0; k < pattern.readings.size(); ++k) {
                const int r = pattern.readings[k];
                const double c = pattern.share[k] / problem.readings()[r].standard_uncertainty;
                s[side] += c * equations.residuals()[r];
                square[side] += c * c;
                equations.row(r).add_to(gradients.col(side), c);
            }
        }
        const BorderedFactor::OfSides q = square - factor.inverse_squares(gradients);
        for (int side = 0; side < count; ++side)
            scores.emplace_back(s[side], q[side] > least_share * square[side] ? q[side] : 0.0);
    }
    return scores;
}

FaultHypotheses::FaultHypotheses(const AdjustmentProblem& problem) {
    std::map<std::pair<int, int>, std::vector<int>> by_channel;
    std::vector<double> farthest(problem.setups().size());
    for (const AdjustedPoint& point : problem.points())
        farthest[point.setup] = std::max(farthest[point.setup], point.place.travel);
    part_of_travel_.resize(problem.readings().size());
    for (const AdjustedPoint& point : problem.points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            by_channel[{point.setup, problem.readings()[r].channel}].push_back(r);
            part_of_travel_[r] = point.place.travel / farthest[point.setup];
        }
    for (auto& [place, readings] : by_channel) {
        std::sort(readings.begin(), readings.end(),
                  [&](int a, int b) { return problem.readings()[a].row < problem.readings()[b].row; });
        const int sequence = int(sequences_.size());
        std::vector<int> used;
        for (int i = 0; i < int(readings.size()); ++i)
            if (problem.readings()[readings[i]].used()) used.push_back(i);
        const bool free = has_free_constant(problem.setups()[place.first], place.second);
        const int count = int(used.size());
        for (int i = free && count == 2 ? 1 : 0; i < count; ++i)
            all_.push_back({FaultKind::reading, sequence, used[i]});
        for (int i = free ? 2 : 0; i < count - 1; ++i) all_.push_back({FaultKind::slip, sequence, used[i]});
        const bool is_only_distance = place.second == 0 && problem.setups()[place.first].model.beams() == 0;
        if (is_only_distance && count > 2) all_.push_back({FaultKind::factor, sequence, 0});
        // Of two readings the slip is the other reading's fault.
        if (free && count > 2) first_.push_back({used[0], used[1]});
        else first_.push_back({none, none});
        is_tilt_.push_back(!problem.is_length(problem.readings()[readings.front()]));
        sequences_.push_back({place.first, place.second, std::move(readings)});
    }
}

FaultHypotheses::Readings FaultHypotheses::readings(const FaultHypothesis& hypothesis) const {
    const std::vector<int>& sequence = sequences_[hypothesis.sequence].readings;
    const int* first = sequence.data() + hypothesis.first;
    return {first, hypothesis.kind == FaultKind::reading ? first + 1 : sequence.data() + sequence.size()};
}

ReadingPattern FaultHypotheses::pattern(const FaultHypothesis& hypothesis) const {
    ReadingPattern pattern;
    for (const int r : readings(hypothesis)) {
        pattern.readings.push_back(r);
        pattern.share.push_back(share(hypothesis, r));
    }
    return pattern;
}

std::optional<FaultHypothesis> FaultHypotheses::as_slip(const FaultHypothesis& reading) const {
    const auto [first, second] = first_[reading.sequence];
    if (reading.kind != FaultKind::reading || first == none || reading.first != first) return std::nullopt;
    return FaultHypothesis{FaultKind::slip, reading.sequence, second};
}

FaultHypothesis FaultHypotheses::as_tested(const FaultHypothesis& hypothesis) const {
    const auto [first, second] = first_[hypothesis.sequence];
    if (hypothesis.kind != FaultKind::slip || first == none || hypothesis.first != second) return hypothesis;
    return {FaultKind::reading, hypothesis.sequence, first};
}

bool FaultHypotheses::differs_from_slip(const FaultHypothesis& reading) const {
    return as_slip(reading) && is_tilt_[reading.sequence];
}

FaultTests::FaultTests(const NormalEquations& equations, const BorderedFactor& factor, const BorderedBand& inverse,
                       const Eigen::VectorXd& variances, const FaultHypotheses& hypotheses,
                       const Eigen::VectorXd& residuals)
    : equations_(&equations), factor_(&factor), hypotheses_(&hypotheses), residuals_(residuals) {
    const std::vector<AdjustedReading>& readings = equations.problem().readings();
    weight_.setZero(Eigen::Index(readings.size()));
    for (std::size_t r = 0; r < readings.size(); ++r)
        if (readings[r].used()) weight_[r] = 1.0 / readings[r].standard_uncertainty;

    const std::vector<FaultHypothesis>& all = hypotheses.all();
    c_r_c_.resize(all.size());
    scores_.resize(all.size());
    sum_readings();
    const auto of_slips = slip_squares(hypotheses.sequences(), equations, factor, inverse, variances, weight_);
    std::vector<double> found(all.size());
    std::vector<int> factors, others;
    for (int h = 0; h < int(all.size()); ++h) {
        (all[h].kind == FaultKind::factor ? factors : others).push_back(h);
        if (all[h].kind == FaultKind::slip) found[h] = of_slips[all[h].sequence][all[h].first];
        if (all[h].kind != FaultKind::reading) continue;
        const int r = *hypotheses.readings(all[h]).begin();
        found[h] = weight_[r] * weight_[r] * (1.0 - variances[r]);
    }
    solve_for(factors);
    for (const int h : others) set(h, found[h]);
    if (!are_exact(others, found)) solve_for(others);
}

// Where the equations are ill-conditioned their inverse loses digits that half a solution does not lose: those that are
// nearest to not being controlled tell.
bool FaultTests::are_exact(std::vector<int> list, const std::vector<double>& found) {
    constexpr double tolerance = 1e-3;
    const auto distance = [&](int h) {
        return std::abs(std::log(std::max(found[h], 0.0) / (controlled_share * square(h))));
    };
    const std::size_t count = std::min<std::size_t>(BorderedFactor::sides, list.size());
    std::partial_sort(list.begin(), list.begin() + std::ptrdiff_t(count), list.end(),
                      [&](int a, int b) { return distance(a) < distance(b); });
    list.resize(count);
    std::vector<double> before;
    for (const int h : list) before.push_back(c_r_c_[h]);
    solve_for(list);
    for (std::size_t k = 0; k < count; ++k) {
        const double q = c_r_c_[list[k]], least = controlled_share * square(list[k]);
        if (std::abs(before[k] - q) > tolerance * std::max(q, least)) return false;
    }
    return true;
}

void FaultTests::sum_readings() {
    const std::vector<FaultHypothesis>& all = hypotheses_->all();
    std::vector<std::vector<std::array<double, 2>>> from;  // of a sequence's readings from each place to its end
    for (const ReadingSequence& sequence : hypotheses_->sequences()) {
        auto& sums = from.emplace_back(sequence.readings.size() + 1, std::array<double, 2>{});
        for (std::size_t i = sequence.readings.size(); i-- > 0;) {
            const int r = sequence.readings[i];
            sums[i] = {sums[i + 1][0] + weight_[r] * weight_[r], sums[i + 1][1] + weight_[r] * residuals_[r]};
        }
    }
    for (const FaultHypothesis& h : all) {
        std::array<double, 2> sums{};
        if (h.kind == FaultKind::slip) sums = from[h.sequence][h.first];
        else
            for (const int r : hypotheses_->readings(h)) {
                sums[0] += std::pow(weight(h, r), 2);
                sums[1] += weight(h, r) * residuals_[r];
            }
        square_.push_back(sums[0]);
        product_.push_back(sums[1]);
    }
}

void FaultTests::solve_for(const std::vector<int>& list) {
    for (std::size_t first = 0; first < list.size(); first += BorderedFactor::sides) {
        const int* some = list.data() + first;
        const int count = int(std::min<std::size_t>(BorderedFactor::sides, list.size() - first));
        const BorderedFactor::OfSides squares = factor_->inverse_squares(gradients(some, count));
        for (int k = 0; k < count; ++k) set(some[k], square(some[k]) - squares[k]);
    }
}

void FaultTests::set(int hypothesis, double c_r_c) {
    c_r_c_[hypothesis] = c_r_c < controlled_share * square(hypothesis) ? 0.0 : c_r_c;
    scores_[hypothesis] = FaultScore(product_[hypothesis], c_r_c_[hypothesis]);
}

void FaultTests::add_gradient(const FaultHypothesis& hypothesis, NormalEquations::Side gradient) const {
    for (const int r : hypotheses_->readings(hypothesis))
        if (weight_[r] > 0.0) equations_->row(r).add_to(gradient, weight(hypothesis, r));
}

BorderedFactor::Sides FaultTests::gradients(const int* hypotheses, int count) const {
    BorderedFactor::Sides gradients = BorderedFactor::Sides::Zero(equations_->problem().size(), BorderedFactor::sides);
    for (int k = 0; k < count; ++k) add_gradient(hypotheses_->all()[hypotheses[k]], gradients.col(k));
    return gradients;
}

BorderedFactor::Sides FaultTests::effects(const int* hypotheses, int count) const {
    BorderedFactor::Sides effects = gradients(hypotheses, count);
    factor_->solve(effects);
    return effects;
}

Eigen::VectorXd FaultTests::effect(const FaultHypothesis& hypothesis) const {
    Eigen::VectorXd effect = Eigen::VectorXd::Zero(equations_->problem().size());
    add_gradient(hypothesis, effect);
    factor_->solve(effect);
    return effect;
}

std::vector<double> FaultTests::correlations(int hypothesis) const {
    std::vector<double> correlations(hypotheses_->all().size());
    each_correlation(&hypothesis, 1, effects(&hypothesis, 1),
                     [&](int h, const BorderedFactor::OfSides& found) { correlations[h] = found[0]; });
    return correlations;
}

}  // namespace stepdiag
