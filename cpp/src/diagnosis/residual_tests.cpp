#include "diagnosis/residual_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <unsupported/Eigen/SpecialFunctions>

#include "diagnosis/fault_tests.hpp"
#include "evaluation/fit_test.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

constexpr double fewest_freedom = 1.0;  // on either side of a comparison

struct Share {
    double square_sum = 0.0;
    double freedom = 0.0;           // sum of redundancies
    double freedom_by_noise = 0.0;  // of those by noise alone

    void add(const Share& other) {
        square_sum += other.square_sum;
        freedom += other.freedom;
        freedom_by_noise += other.freedom_by_noise;
    }
    Share rest_of(const Share& all) const {
        return {all.square_sum - square_sum, all.freedom - freedom, all.freedom_by_noise - freedom_by_noise};
    }
    double mean_square() const { return square_sum / freedom; }
};

// Probability that F of these degrees of freedom lies as far from 1 as this one, on its side, or on the other: that of
// a mean square which is less than another, its freedom being that by noise alone.
double two_sided_probability(const Share& less, const Share& more) {
    if (!(less.freedom_by_noise > 0.0)) return 1.0;
    const double f = less.square_sum / less.freedom_by_noise / more.mean_square();
    if (f >= 1.0) return 1.0;
    const double ratio = less.freedom_by_noise * f / more.freedom;
    return 2.0 * Eigen::numext::betainc(0.5 * less.freedom_by_noise, 0.5 * more.freedom, ratio / (1.0 + ratio));
}

// That chance makes the square of one standard normal number as large as this, the others' mean square being 1 of this
// freedom: F(1, freedom).
double score_probability(double square, double freedom) {
    return Eigen::numext::betainc(0.5 * freedom, 0.5, freedom / (freedom + square));
}

// When each row was read, from 0 at the first to 1 at the last: by its time, or by the order of the rows.
std::vector<double> progress(const Measurement& measurement) {
    std::vector<double> when(measurement.size());
    const Channel* time = measurement.find("time");
    const bool timed = time && std::all_of(time->value.begin(), time->value.end(), [](const auto& t) { return !!t; });
    for (std::size_t row = 0; row < when.size(); ++row) when[row] = timed ? *time->value[row] : double(row);
    if (when.empty()) return when;
    const auto [first, last] = std::minmax_element(when.begin(), when.end());
    const double start = *first, span = *last - *first;
    for (double& t : when) t = span > 0.0 ? (t - start) / span : 0.0;
    return when;
}

// --- scatter ---

struct ReadingGroup {
    std::string line, channel;
    int run = -1;
    FitAspect aspect = FitAspect::whole;

    bool operator<(const ReadingGroup& o) const {
        return std::tie(line, channel, run, aspect) < std::tie(o.line, o.channel, o.run, o.aspect);
    }
};

// A group and its complement make the same comparison: of the halves one is enough.
std::map<ReadingGroup, Share> shares_of_groups(const std::vector<ReadingResidual>& residuals,
                                               const std::vector<ReadingResidual>& by_noise,
                                               const Measurement& measurement, Share& all) {
    const std::vector<double> when = progress(measurement);
    std::map<std::string, int> lines;  // in the order of their names
    std::vector<int> line_of;          // by row
    for (const Station& station : measurement.stations()) {
        lines.try_emplace(station.line.name(), int(lines.size()));
        line_of.push_back(lines.at(station.line.name()));
    }
    std::vector<int> last_point(lines.size());
    for (std::size_t row = 0; row < line_of.size(); ++row)
        last_point[line_of[row]] = std::max(last_point[line_of[row]], measurement.stations()[row].point);

    const auto& channels = measurement.channels();
    const auto channel_of = [&](const std::string& name) {
        return std::find_if(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == name; }) -
               channels.begin();
    };
    std::vector<Share> of_line(lines.size()), of_channel(channels.size());
    std::vector<std::vector<Share>> of_both(lines.size(), of_channel);
    std::map<int, Share> of_run;
    for (const Station& station : measurement.stations()) of_run[station.run];
    Share second_half, far_half;
    for (std::size_t k = 0; k < residuals.size(); ++k) {
        const ReadingResidual& r = residuals[k];
        if (!r.used() || r.redundancy == 0.0) continue;
        const Station& station = measurement.stations()[r.row];
        const int line = line_of[r.row];
        const auto channel = channel_of(r.channel);
        const Share share{r.normalised * r.normalised * r.redundancy, r.redundancy, by_noise[k].redundancy};
        for (Share* sum : {&all, &of_line[line], &of_channel[channel], &of_both[line][channel], &of_run[station.run]})
            sum->add(share);
        if (when[r.row] > 0.5) second_half.add(share);
        if (2 * station.point > last_point[line]) far_half.add(share);
    }
    std::map<ReadingGroup, Share> groups;
    for (const auto& [line, l] : lines) {
        groups[{line, ""}] = of_line[l];
        for (std::size_t c = 0; c < channels.size(); ++c) groups[{line, channels[c].name}] = of_both[l][c];
    }
    for (std::size_t c = 0; c < channels.size(); ++c) groups[{"", channels[c].name}] = of_channel[c];
    if (of_run.size() > 1)
        for (const auto& [run, share] : of_run) groups[{"", "", run}] = share;
    groups[{"", "", -1, FitAspect::second_half}] = second_half;
    groups[{"", "", -1, FitAspect::far_half}] = far_half;
    return groups;
}

std::vector<ResidualPattern> scatter_of_groups(const std::map<ReadingGroup, Share>& groups, const Share& all) {
    std::vector<ResidualPattern> patterns;
    for (const auto& [group, share] : groups) {
        const Share others = share.rest_of(all);
        if (share.freedom < fewest_freedom || others.freedom < fewest_freedom || !(others.square_sum > 0.0)) continue;
        FitReason reason{FitFinding::uneven_misfit, std::sqrt(share.mean_square()), std::sqrt(others.mean_square()),
                         group.line, group.channel};
        reason.run = group.run;
        reason.aspect = group.aspect;
        const bool is_less = share.mean_square() < others.mean_square();
        patterns.push_back(
            {reason, is_less ? two_sided_probability(share, others) : two_sided_probability(others, share)});
    }
    return patterns;
}

bool is_more_conspicuous(const ResidualPattern& a, const ResidualPattern& b) { return a.probability < b.probability; }

// --- trends ---

// The readings of one channel, on one line or on all; their shares: how far along each of them was made, from 0 to 1.
struct Trend {
    std::string line, channel;
    FitAspect aspect;
    ReadingPattern pattern;
    std::vector<int> setup;
};

class TrendTests {
public:
    TrendTests(const Measurement& measurement, const NormalEquations& equations, const BorderedFactor& factor)
        : problem_(equations.problem()), equations_(equations), factor_(factor) {
        collect(progress(measurement));
    }

    const std::vector<Trend>& trends() const { return trends_; }

    std::vector<FaultScore> scores() const {
        constexpr double controlled = 1e-6;
        std::vector<const ReadingPattern*> patterns;
        for (const Trend& trend : trends_) patterns.push_back(&trend.pattern);
        return scores_of(patterns, equations_, factor_, controlled);
    }

private:
    void collect(const std::vector<double>& when) {
        using Both = std::array<Trend, 2>;  // with time, with position
        std::map<std::pair<std::string, std::string>, Both> found;
        std::map<std::pair<int, int>, std::array<Both*, 2>> of;  // by set-up and channel: of its line, of all
        double longest = 0.0;
        for (const AdjustedPoint& point : problem_.points()) longest = std::max(longest, std::abs(point.place.travel));
        for (const AdjustedPoint& point : problem_.points())
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                const AdjustedReading& reading = problem_.readings()[r];
                if (!reading.used()) continue;
                const auto [at, is_new] = of.try_emplace({point.setup, reading.channel});
                if (is_new) {
                    const std::string channel = problem_.channel_name(reading);
                    at->second = {&found[{problem_.setups()[point.setup].line.name(), channel}], &found[{"", channel}]};
                }
                for (Both* both : at->second) {
                    for (Trend& trend : *both) {
                        trend.pattern.readings.push_back(r);
                        trend.setup.push_back(point.setup);
                    }
                    both->front().pattern.share.push_back(when[reading.row]);
                    both->back().pattern.share.push_back(longest > 0.0 ? point.place.travel / longest : 0.0);
                }
            }
        for (auto& entry : found) {
            auto& [time, position] = entry.second;
            for (Trend* trend : {&time, &position}) std::tie(trend->line, trend->channel) = entry.first;
            time.aspect = FitAspect::time;
            position.aspect = FitAspect::position;
            // On one line each set-up counts from its own mean: the constants of set-ups are another matter.
            for (Trend* trend : {&time, &position}) centre(*trend, !entry.first.first.empty());
            if (alike(time, position)) position.aspect = FitAspect::time_or_position;
            else trends_.push_back(time);
            trends_.push_back(position);
        }
    }

    static void centre(Trend& trend, bool each_setup) {
        std::vector<double>& along = trend.pattern.share;
        std::map<int, std::pair<double, int>> sums;
        double least = INFINITY, most = -INFINITY;
        for (std::size_t k = 0; k < along.size(); ++k) {
            auto& [sum, count] = sums[each_setup ? trend.setup[k] : 0];
            sum += along[k];
            ++count;
        }
        for (std::size_t k = 0; k < along.size(); ++k) {
            const auto& [sum, count] = sums[each_setup ? trend.setup[k] : 0];
            along[k] -= sum / count;
            least = std::min(least, along[k]);
            most = std::max(most, along[k]);
        }
        if (most > least)  // sizes are from the first to the last
            for (double& a : along) a /= most - least;
    }

    static bool alike(const Trend& a, const Trend& b) {
        double ab = 0.0, aa = 0.0, bb = 0.0;
        for (std::size_t k = 0; k < a.setup.size(); ++k) {
            const double along_a = a.pattern.share[k], along_b = b.pattern.share[k];
            ab += along_a * along_b;
            aa += along_a * along_a;
            bb += along_b * along_b;
        }
        return ab * ab > 0.99 * aa * bb;
    }

    const AdjustmentProblem& problem_;
    const NormalEquations& equations_;
    const BorderedFactor& factor_;
    std::vector<Trend> trends_;
};

std::vector<ResidualPattern> trends_of_readings(const Adjustment& adjustment, const TrendTests& tests) {
    const double freedom = adjustment.degrees_of_freedom - 1.0;
    std::vector<ResidualPattern> patterns;
    if (freedom < fewest_freedom) return patterns;
    const std::vector<FaultScore> scores = tests.scores();
    for (std::size_t t = 0; t < scores.size(); ++t) {
        const Trend& trend = tests.trends()[t];
        const FaultScore& score = scores[t];
        if (score.gain == 0.0) continue;
        // Where all readings scatter more than was said, it is measured against that.
        const double others = std::max(1.0, (adjustment.weighted_square_sum - score.gain) / freedom);
        FitReason reason{FitFinding::trend, score.size, 0.0, trend.line, trend.channel};
        reason.standard_uncertainty = score.standard_uncertainty * std::sqrt(others);
        reason.aspect = trend.aspect;
        patterns.push_back({reason, score_probability(score.gain / others, freedom)});
    }
    return patterns;
}

double chi_square(const FitReason& trend) { return std::pow(trend.value / trend.standard_uncertainty, 2); }

// The best, and those that the readings do not tell from it.
void keep_the_best(std::vector<ResidualPattern>& patterns) {
    constexpr double least_share = 0.5;  // of the best one's chi-square
    if (patterns.empty()) return;
    std::stable_sort(patterns.begin(), patterns.end(), is_more_conspicuous);
    const double best = chi_square(patterns.front().reason), alike = patterns.front().probability;
    std::size_t kept = 1;
    while (kept < patterns.size() &&
           chi_square(patterns[kept].reason) > std::max(best - thresholds.alternative, least_share * best))
        ++kept;
    patterns.resize(kept);
    for (std::size_t k = 1; k < patterns.size(); ++k) {
        patterns[k].probability = alike;
        patterns[k].reason.alternative = true;
    }
}

}  // namespace

ResidualPattern less_noise(const std::vector<ReadingResidual>& residuals, const ResidualsByNoise& by_noise) {
    const auto sum_of = [](const std::vector<ReadingResidual>& list) {
        Share sum;
        for (const ReadingResidual& r : list)
            if (r.used()) sum.add({r.normalised * r.normalised * r.redundancy, r.redundancy});
        return sum;
    };
    const Share all = sum_of(residuals);
    ResidualPattern pattern{{FitFinding::no_misfit, 1.0, 1.0}, 1.0};
    if (all.freedom < fewest_freedom) return pattern;
    pattern.reason.value = std::sqrt(all.mean_square());
    pattern.reason.standard_uncertainty = pattern.reason.value / std::sqrt(2.0 * all.freedom);
    const auto probability = [&](double freedom) { return 1.0 - chi_square_probability(all.square_sum, freedom); };
    pattern.probability = probability(all.freedom);
    if (pattern.probability < 1.0 - thresholds.no_misfit_doubtful) {
        const double freedom = sum_of(by_noise()).freedom;
        pattern.probability = freedom > 0.0 ? probability(freedom) : 1.0;
    }
    return pattern;
}

std::vector<ResidualPattern> residual_patterns(const Adjustment& adjustment, const ResidualsByNoise& by_noise,
                                               const Measurement& measurement, const NormalEquations& equations,
                                               const BorderedFactor& factor) {
    const auto of_groups = [&](const std::vector<ReadingResidual>& with) {
        Share all;
        const auto groups = shares_of_groups(adjustment.residuals, with, measurement, all);
        return scatter_of_groups(groups, all);
    };
    std::vector<ResidualPattern> scatter = of_groups(adjustment.residuals);
    std::vector<ResidualPattern> trends = trends_of_readings(adjustment, TrendTests(measurement, equations, factor));
    const double tests = double(scatter.size() + trends.size());
    const auto most_conspicuous = [&] { return std::min_element(scatter.begin(), scatter.end(), is_more_conspicuous); };
    // Redundancies by noise alone are the smaller ones: where nothing is conspicuous by all of them, nothing is by
    // those.
    if (!scatter.empty() && tests * most_conspicuous()->probability < thresholds.pattern)
        scatter = of_groups(by_noise());
    if (scatter.size() > 1) {
        std::iter_swap(scatter.begin(), most_conspicuous());
        scatter.resize(1);
    }
    keep_the_best(trends);
    scatter.insert(scatter.end(), trends.begin(), trends.end());
    for (ResidualPattern& pattern : scatter) pattern.probability = std::min(1.0, tests * pattern.probability);
    return scatter;
}

}  // namespace stepdiag
