#include "diagnosis/variance_components.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "evaluation/fit_test.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

constexpr int draws = 16;                  // a multiple of BorderedFactor::sides, whatever that is
constexpr double least_redundancy = 0.02;  // of two readings whose difference counts
constexpr int fewest_differences = 8;
constexpr double least_freedom = 2.0;   // sum of redundancies
constexpr double clear_of_noise = 4.0;  // standard deviations of the draws
// Standard uncertainties by which the factor of a line is clearly larger than that of its channel: there are many
// lines.
constexpr double clear_of_lines = 5.0;

using Draws = Eigen::Matrix<double, Eigen::Dynamic, draws, Eigen::RowMajor>;

// Readings of a channel, on one line or on all those without a group of their own.
struct ChannelGroup {
    std::string channel, line;
    std::vector<int> readings;
    double freedom = 0.0;  // sum of redundancies
    struct Difference {
        int a, b;
        double redundancy;  // of both
    };
    std::vector<Difference> differences;
};

using Key = std::pair<std::string, std::string>;  // channel, line

// A group for each key that is asked for, else for the channel.
std::vector<ChannelGroup> groups_of(Solution& solution, const std::vector<Key>& of_lines) {
    const AdjustmentProblem& problem = solution.problem();
    const Eigen::VectorXd& variances = solution.reading_variances();
    std::map<Key, ChannelGroup> groups;
    std::map<std::pair<int, int>, std::pair<ChannelGroup*, std::vector<int>>> sequences;  // by set-up and channel
    for (const AdjustedPoint& point : problem.points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const AdjustedReading& reading = problem.readings()[r];
            if (!reading.used()) continue;
            auto& [group, sequence] = sequences[{point.setup, reading.channel}];
            if (!group) {
                Key key{problem.noise_channel(reading), problem.setups()[point.setup].line.name()};
                if (std::find(of_lines.begin(), of_lines.end(), key) == of_lines.end()) key.second.clear();
                group = &groups[key];
                std::tie(group->channel, group->line) = key;
            }
            group->readings.push_back(r);
            group->freedom += 1.0 - variances[r];
            sequence.push_back(r);
        }
    for (auto& entry : sequences) {
        auto& [group, sequence] = entry.second;
        std::sort(sequence.begin(), sequence.end(),
                  [&](int a, int b) { return problem.readings()[a].row < problem.readings()[b].row; });
        for (std::size_t i = 1; i < sequence.size(); ++i) {
            const int a = sequence[i - 1], b = sequence[i];
            const double redundancy = 2.0 - variances[a] - variances[b];
            if (redundancy > least_redundancy) group->differences.push_back({a, b, redundancy});
        }
    }
    std::vector<ChannelGroup> list;
    for (auto& entry : groups) list.push_back(std::move(entry.second));
    return list;
}

// R z of draws z that are 0 beside some readings.
Draws responses(const Solution& solution, const std::vector<int>& readings) {
    const NormalEquations& equations = solution.solver().equations();
    Draws z = Draws::Zero(Eigen::Index(solution.problem().readings().size()), draws);
    for (const int r : readings) {
        const AdjustedReading& reading = solution.problem().readings()[r];
        for (int k = 0; k < draws; k += 2) {
            const auto pair = normal_pair(0, RandomStream::variance_components,
                                          {reading.row, std::uint32_t(reading.channel), std::uint16_t(k / 2)});
            z.row(r).segment<2>(k) << pair[0], pair[1];
        }
    }
    constexpr int sides = BorderedFactor::sides;
    static_assert(draws % sides == 0, "draws are solved for side by side");
    for (int first = 0; first < draws; first += sides) {
        BorderedFactor::Sides x = BorderedFactor::Sides::Zero(solution.problem().size(), sides);
        for (const int r : readings) equations.row(r).add_to(x, z.row(r).segment<sides>(first));
        solution.solver().factor().solve(x);
        z.middleCols<sides>(first) -= equations.images(x).topRows(z.rows());
    }
    return z;
}

struct Factor {
    double value, standard_uncertainty;
};

// Roots of mean squares: of the readings' residuals, of the smaller half of the differences, and of all of them.
struct Scales {
    double residuals, smaller_half, differences;
};

template <class Residual>
Scales scales(const ChannelGroup& group, const Residual& residual) {
    double of_residuals = 0.0;
    for (const int r : group.readings) of_residuals += std::pow(residual(r), 2);
    std::vector<double> squares;
    for (const ChannelGroup::Difference& d : group.differences)
        squares.push_back(std::pow(residual(d.b) - residual(d.a), 2) / d.redundancy);
    const auto half = squares.begin() + std::ptrdiff_t(squares.size() / 2);
    std::nth_element(squares.begin(), half, squares.end());
    const double smaller = std::accumulate(squares.begin(), half, 0.0);
    return {std::sqrt(of_residuals / double(group.readings.size())),
            std::sqrt(smaller / double(half - squares.begin())),
            std::sqrt(std::accumulate(half, squares.end(), smaller) / double(squares.size()))};
}

// Of the residuals beside those of the draws.
class Comparison {
public:
    Comparison(const ChannelGroup& group, const Eigen::VectorXd& residuals, const Draws& noise)
        : is_possible_(int(group.differences.size()) >= fewest_differences) {
        if (!is_possible_) return;
        observed_ = scales(group, [&](int r) { return residuals[r]; });
        for (int k = 0; k < draws; ++k) drawn_[std::size_t(k)] = scales(group, [&](int r) { return noise(r, k); });
    }

    // By the smaller half of the differences.
    Factor robust() const {
        if (!is_possible_) return {1.0, INFINITY};
        const auto [mean, deviation] = of_draws([](const Scales& s) { return s.smaller_half; });
        const double value = observed_.smaller_half / mean;
        return {value, value * deviation / mean};
    }
    // Whether differences are as large beside the residuals as those of noise: gross readings make the smaller half of
    // them small, and what is smooth makes all of them small.
    bool is_noise() const {
        if (!is_possible_) return true;
        const auto is_small = [&](const auto& ratio) {
            const auto [mean, deviation] = of_draws(ratio);
            return ratio(observed_) < mean - clear_of_noise * deviation;
        };
        return !is_small([](const Scales& s) { return s.smaller_half / s.residuals; }) &&
               !is_small([](const Scales& s) { return s.differences / s.residuals; });
    }

private:
    template <class Quantity>
    std::pair<double, double> of_draws(const Quantity& quantity) const {
        Eigen::Array<double, draws, 1> values;
        for (int k = 0; k < draws; ++k) values[k] = quantity(drawn_[std::size_t(k)]);
        const double mean = values.mean();
        return {mean, std::sqrt((values - mean).square().sum() / (draws - 1))};
    }

    bool is_possible_;
    Scales observed_ = {};
    std::array<Scales, draws> drawn_ = {};
};

bool is_clearly_larger(const Factor& one, const Factor& other) {
    const double relative = std::sqrt(std::pow(one.standard_uncertainty / one.value, 2) +
                                      std::pow(other.standard_uncertainty / other.value, 2));
    return one.value > other.value * (1.0 + clear_of_lines * relative);
}

// By square sums.
std::vector<Factor> factors_of_squares(const std::vector<ChannelGroup>& groups, const Eigen::VectorXd& residuals,
                                       const std::vector<Draws>& noise) {
    const Eigen::Index count = Eigen::Index(groups.size());
    Eigen::MatrixXd s(count, count);
    Eigen::VectorXd q = Eigen::VectorXd::Zero(count);
    for (Eigen::Index c = 0; c < count; ++c) {
        for (const int r : groups[std::size_t(c)].readings) q[c] += residuals[r] * residuals[r];
        for (Eigen::Index d = 0; d < count; ++d) {
            double sum = 0.0;
            for (const int r : groups[std::size_t(c)].readings) sum += noise[std::size_t(d)].row(r).squaredNorm();
            s(c, d) = sum / draws;
        }
        s.row(c) *= groups[std::size_t(c)].freedom / s.row(c).sum();
    }
    const Eigen::MatrixXd inverse = s.inverse();
    const Eigen::VectorXd v = inverse * q;
    std::vector<Factor> factors;
    for (Eigen::Index c = 0; c < count; ++c) {
        const double value = std::sqrt(std::max(0.0, v[c]));
        // Of the variance sqrt(2 S^-1) times itself, of its root half of that.
        const double relative = inverse(c, c) > 0.0 ? 0.5 * std::sqrt(2.0 * inverse(c, c)) : INFINITY;
        factors.push_back({value, std::max(value, 1.0) * relative});
    }
    return factors;
}

// Times the noise that was stated.
double weighed_with(const AdjustmentProblem& problem, const ChannelGroup& group) {
    const AdjustedReading& reading = problem.readings()[group.readings.front()];
    return reading.standard_uncertainty / reading.noise;
}

// That chance makes a factor as large where it is 1: its square is a chi-square of so much freedom.
double probability_of_factor(const Factor& factor) {
    const double relative = factor.standard_uncertainty / std::max(factor.value, 1.0);
    const double freedom = 0.5 / (relative * relative);
    return chi_square_probability(factor.value * factor.value * freedom, freedom);
}

// Lines on which a channel scatters clearly more than on its others.
std::vector<Key> uneven_lines(Solution& solution, const std::vector<ChannelGroup>& groups,
                              const Eigen::VectorXd& residuals, const Draws& noise) {
    std::vector<Key> every, uneven;
    for (const LineSetup& setup : solution.problem().setups())
        for (const ChannelGroup& group : groups) every.emplace_back(group.channel, setup.line.name());
    const std::vector<ChannelGroup> of_lines = groups_of(solution, every);
    for (const ChannelGroup& channel : groups) {
        if (!channel.line.empty()) continue;
        const Factor usual = Comparison(channel, residuals, noise).robust();
        for (const ChannelGroup& line : of_lines) {
            if (line.channel != channel.channel) continue;
            const Factor factor = Comparison(line, residuals, noise).robust();
            if (factor.standard_uncertainty < thresholds.widest_component * factor.value &&
                is_clearly_larger(factor, usual))
                uneven.emplace_back(line.channel, line.line);
        }
    }
    return uneven;
}

bool is_odd(const std::vector<Factor>& factors) {
    return std::any_of(factors.begin(), factors.end(), [](const Factor& factor) {
        return factor.value > 1.0 && probability_of_factor(factor) < odd_scatter;
    });
}

}  // namespace

std::vector<ScatterOfChannel> scatter_of_channels(Solution& solution, const std::vector<NoiseFactor>& weighed) {
    const Eigen::VectorXd& residuals = solution.solver().equations().residuals();
    std::vector<Key> of_lines;
    for (const NoiseFactor& each : weighed)
        if (!each.line.empty()) of_lines.emplace_back(each.channel, each.line);
    std::vector<ChannelGroup> groups;
    std::vector<Factor> factors;
    Draws noise;  // of all groups, each with its factor
    const auto look = [&] {
        groups.clear();
        for (ChannelGroup& group : groups_of(solution, of_lines))
            if (group.freedom >= least_freedom) groups.push_back(std::move(group));
        std::vector<Draws> by_group;
        for (const ChannelGroup& group : groups) by_group.push_back(responses(solution, group.readings));
        factors = factors_of_squares(groups, residuals, by_group);
        noise = Draws::Zero(residuals.size(), draws);
        for (std::size_t g = 0; g < groups.size(); ++g) noise += std::max(1.0, factors[g].value) * by_group[g];
    };
    look();
    const bool is_closer = is_odd(factors) || !weighed.empty();
    if (is_closer) {
        const std::size_t known = of_lines.size();
        for (const Key& line : uneven_lines(solution, groups, residuals, noise)) of_lines.push_back(line);
        if (of_lines.size() > known) look();
    }
    std::vector<ScatterOfChannel> scatter;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        ScatterOfChannel of;
        Factor factor = factors[g];
        if (is_closer) {
            const Comparison comparison(groups[g], residuals, noise);
            of.is_noise = comparison.is_noise();
            if (!of.is_noise) {
                factor = comparison.robust();
                for (double* each : {&factor.value, &factor.standard_uncertainty})
                    *each *= std::max(1.0, factors[g].value);
            }
        }
        const double before = weighed_with(solution.problem(), groups[g]);
        factor = {before * factor.value, before * factor.standard_uncertainty};
        if (!std::isfinite(factor.standard_uncertainty)) continue;
        const bool is_used = std::any_of(weighed.begin(), weighed.end(), [&](const NoiseFactor& each) {
            return each.channel == groups[g].channel && each.line == groups[g].line && each.factor > 1.0;
        });
        of.component = {{groups[g].channel, groups[g].line, factor.value}, factor.standard_uncertainty, is_used};
        if (factor.value > 1.0) of.probability = probability_of_factor(factor);
        of.is_significant = factor.standard_uncertainty < thresholds.widest_component * std::max(1.0, factor.value) &&
                            of.probability < thresholds.noise_component;
        scatter.push_back(of);
    }
    return scatter;
}

std::vector<NoiseFactor> to_weigh(const std::vector<ScatterOfChannel>& scatter) {
    std::vector<NoiseFactor> factors;
    for (const ScatterOfChannel& each : scatter)
        if (each.is_significant) factors.push_back(each.component.noise);
        // What is as stated on a line of its own is not the channel's.
        else if (!each.component.noise.line.empty())
            factors.push_back({each.component.noise.channel, each.component.noise.line, 1.0});
    return factors;
}

bool are_alike(const std::vector<NoiseFactor>& a, const std::vector<NoiseFactor>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const NoiseFactor& one, const NoiseFactor& other) {
        return one.channel == other.channel && one.line == other.line &&
               std::abs(one.factor - other.factor) < 0.01 * one.factor;
    });
}

}  // namespace stepdiag
