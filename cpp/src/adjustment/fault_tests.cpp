#include "adjustment/fault_tests.hpp"

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

FaultScore score_of(const ReadingPattern& pattern, const NormalEquations& equations, const BorderedFactor& factor,
                    double least_share) {
    const AdjustmentProblem& problem = equations.problem();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(problem.size());  // J^T c
    double s = 0.0, square = 0.0;
    for (std::size_t k = 0; k < pattern.readings.size(); ++k) {
        const int r = pattern.readings[k];
        const double c = pattern.share[k] / problem.readings()[r].standard_uncertainty;
        s += c * equations.residuals()[r];
        square += c * c;
        const NormalEquations::Row row = equations.row(r);
        for (int i = 0; i < row.size; ++i)
            if (row.unknown[i] != no_unknown) gradient[row.unknown[i]] += c * row.derivative[i];
    }
    Eigen::VectorXd effect = gradient;
    factor.solve(effect);
    const double q = square - gradient.dot(effect);
    return {s, q > least_share * square ? q : 0.0};
}

std::string name(FaultKind kind) {
    constexpr const char* names[] = {"reading", "slip", "factor"};
    return names[static_cast<int>(kind)];
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
                       const FaultHypotheses& hypotheses, const Eigen::VectorXd& residuals, int most_solutions)
    : equations_(&equations), factor_(&factor), hypotheses_(&hypotheses), residuals_(residuals) {
    const std::vector<AdjustedReading>& readings = equations.problem().readings();
    weight_.setZero(Eigen::Index(readings.size()));
    for (std::size_t r = 0; r < readings.size(); ++r)
        if (readings[r].used()) weight_[r] = 1.0 / readings[r].standard_uncertainty;

    const std::vector<FaultHypothesis>& all = hypotheses.all();
    const Eigen::VectorXd variance = equations.reading_variances(inverse);
    c_r_c_.resize(all.size());
    scores_.resize(all.size());
    exact_.assign(all.size(), false);
    zeros_.setZero(equations.problem().size());
    for (std::size_t h = 0; h < all.size(); ++h) {
        if (all[h].kind != FaultKind::reading) continue;
        const int r = *hypotheses.readings(all[h]).begin();
        const double share = 1.0 - variance[r];
        set(int(h), share < controlled_share ? 0.0 : weight_[r] * weight_[r] * share);
        exact_[h] = true;
    }
    for (std::size_t h = 0; h < all.size(); ++h)
        if (all[h].kind == FaultKind::factor) refine(int(h));
    test_slips(most_solutions);
}

void FaultTests::test_slips(int most_solutions) {
    const std::vector<FaultHypothesis>& all = hypotheses_->all();
    // By sequence and by the axis that moved last: q goes up and down with that.
    std::map<std::pair<int, int>, std::vector<int>> alike;
    int count = 0;
    for (std::size_t h = 0; h < all.size(); ++h) {
        if (all[h].kind != FaultKind::slip) continue;
        const ReadingSequence& sequence = hypotheses_->sequences()[all[h].sequence];
        const int axes = equations_->problem().setups()[sequence.setup].line.moved_axes();
        alike[{all[h].sequence, all[h].first % axes}].push_back(int(h));
        ++count;
    }
    const int step = std::max(1, (count + most_solutions - 1) / std::max(1, most_solutions));
    std::vector<std::pair<double, int>> likely;  // minus gain: the largest comes first
    for (const auto& [place, slips] : alike)
        for (int i = 0, next, last = int(slips.size()) - 1; i <= last; i = next) {
            next = i == last ? last + 1 : std::min(i + step, last);
            refine(slips[i]);
            if (i == last) break;
            refine(slips[next]);
            for (int k = i + 1; k < next; ++k) {
                const double part = double(k - i) / double(next - i);
                set(slips[k], (1.0 - part) * c_r_c_[slips[i]] + part * c_r_c_[slips[next]]);
                if (4.0 * scores_[slips[k]].gain >= significant) likely.emplace_back(-scores_[slips[k]].gain, slips[k]);
            }
        }
    std::sort(likely.begin(), likely.end());
    if (int(likely.size()) > most_solutions) likely.resize(std::size_t(most_solutions));
    for (const auto& [gain, h] : likely) refine(h);
}

void FaultTests::refine(int hypothesis) {
    if (exact_[hypothesis]) return;
    const double all = square(hypothesis);
    const FaultHypothesis& h = hypotheses_->all()[hypothesis];
    add_gradient(h, zeros_);
    const bool has_leaves = equations_->problem().leaves().size.size() > 0;
    const int leaf = has_leaves ? hypotheses_->sequences()[h.sequence].setup : BorderedFactor::every_leaf;
    const double q = all - factor_->inverse_square(zeros_, leaf);
    for (const int r : hypotheses_->readings(h)) {
        const NormalEquations::Row row = equations_->row(r);
        for (int i = 0; i < row.size; ++i)
            if (row.unknown[i] != no_unknown) zeros_[row.unknown[i]] = 0.0;
    }
    set(hypothesis, q < controlled_share * all ? 0.0 : q);
    exact_[hypothesis] = true;
}

void FaultTests::set(int hypothesis, double c_r_c) {
    c_r_c_[hypothesis] = c_r_c;
    const FaultHypothesis& h = hypotheses_->all()[hypothesis];
    double sum = 0.0;
    for (const int r : hypotheses_->readings(h)) sum += weight(h, r) * residuals_[r];
    scores_[hypothesis] = FaultScore(sum, c_r_c);
}

double FaultTests::square(int hypothesis) const {
    const FaultHypothesis& h = hypotheses_->all()[hypothesis];
    double sum = 0.0;
    for (const int r : hypotheses_->readings(h)) sum += std::pow(weight(h, r), 2);
    return sum;
}

void FaultTests::add_gradient(const FaultHypothesis& hypothesis, Eigen::VectorXd& gradient) const {
    for (const int r : hypotheses_->readings(hypothesis)) {
        if (weight_[r] == 0.0) continue;
        const NormalEquations::Row row = equations_->row(r);
        for (int i = 0; i < row.size; ++i)
            if (row.unknown[i] != no_unknown) gradient[row.unknown[i]] += weight(hypothesis, r) * row.derivative[i];
    }
}

Eigen::VectorXd FaultTests::effect(const FaultHypothesis& hypothesis) const {
    Eigen::VectorXd effect = Eigen::VectorXd::Zero(equations_->problem().size());
    add_gradient(hypothesis, effect);
    factor_->solve(effect);
    return effect;
}

// q, from the effect.
double FaultTests::controlled(int hypothesis, const Eigen::VectorXd& effect) const {
    const FaultHypothesis& h = hypotheses_->all()[hypothesis];
    double q = 0.0;
    for (const int r : hypotheses_->readings(h))
        if (weight_[r] > 0.0) q += weight(h, r) * (weight(h, r) - equations_->row(r).product(effect));
    return q < controlled_share * square(hypothesis) ? 0.0 : q;
}

std::vector<double> FaultTests::correlations(int hypothesis, const Eigen::VectorXd& effect) const {
    const std::vector<FaultHypothesis>& all = hypotheses_->all();
    std::vector<double> correlations(all.size(), 0.0);
    const double own = controlled(hypothesis, effect);
    if (own == 0.0) return correlations;
    Eigen::VectorXd shown = Eigen::VectorXd::Zero(weight_.size());  // R c
    for (const int r : hypotheses_->readings(all[hypothesis])) shown[r] = weight(all[hypothesis], r);
    for (Eigen::Index r = 0; r < weight_.size(); ++r)
        if (weight_[r] > 0.0) shown[r] -= equations_->row(int(r)).product(effect);
    // Of the readings from each place of a sequence to its end.
    std::vector<std::vector<double>> from;
    for (const ReadingSequence& sequence : hypotheses_->sequences()) {
        auto& sums = from.emplace_back(sequence.readings.size() + 1, 0.0);
        for (std::size_t i = sequence.readings.size(); i-- > 0;) {
            const int r = sequence.readings[i];
            sums[i] = sums[i + 1] + weight_[r] * shown[r];
        }
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (c_r_c_[k] == 0.0) continue;
        double product = 0.0;
        if (all[k].kind == FaultKind::slip) product = from[all[k].sequence][all[k].first];
        else
            for (const int r : hypotheses_->readings(all[k])) product += weight(all[k], r) * shown[r];
        correlations[k] = product / std::sqrt(own * c_r_c_[k]);
    }
    return correlations;
}

}  // namespace stepdiag
