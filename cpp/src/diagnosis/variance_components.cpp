#include "diagnosis/variance_components.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "evaluation/fit_test.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

constexpr int draws = 16;                // a multiple of BorderedFactor::sides, whatever that is
constexpr double least_redundancy = 0.02;  // of two readings whose difference counts
constexpr int fewest_differences = 8;
constexpr double fewest_freedom = 2.0;  // sum of redundancies
// Standard uncertainties by which a factor is clearly larger than another one.
constexpr double clear_of_squares = 2.5;  // than the robust one
constexpr double clear_of_lines = 5.0;    // of a line than that of its channel: there are many

using Draws = Eigen::Matrix<double, Eigen::Dynamic, draws, Eigen::RowMajor>;

// Readings of a channel, on one line or on all those without a group of their own.
struct Group {
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
std::vector<Group> groups_of(Solution& solution, const std::vector<Key>& of_lines) {
    const AdjustmentProblem& problem = solution.problem();
    const Eigen::VectorXd& variances = solution.reading_variances();
    std::map<Key, Group> groups;
    std::map<std::pair<int, int>, std::pair<Group*, std::vector<int>>> sequences;  // by set-up and channel
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
    std::vector<Group> list;
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
        for (const int r : readings)
            for (int side = 0; side < sides; ++side) equations.row(r).add_to(x.col(side), z(r, first + side));
        solution.solver().factor().solve(x);
        z.middleCols<sides>(first) -= equations.images(x).topRows(z.rows());
    }
    return z;
}

// Mean of the smaller half of the squares.
template <class Residual>
double smaller_half(const Group& group, const Residual& residual) {
    std::vector<double> squares;
    for (const Group::Difference& d : group.differences)
        squares.push_back(std::pow(residual(d.b) - residual(d.a), 2) / d.redundancy);
    const auto half = squares.begin() + std::ptrdiff_t(squares.size() / 2);
    std::nth_element(squares.begin(), half, squares.end());
    double sum = 0.0;
    for (auto each = squares.begin(); each != half; ++each) sum += *each;
    return sum / double(half - squares.begin());
}

struct Factor {
    double value, standard_uncertainty;
};

// Whether one factor is clearly larger than another one, were both of the same scatter.
bool is_clearly_larger(const Factor& one, const Factor& other, double clear) {
    const double relative = std::sqrt(std::pow(one.standard_uncertainty / one.value, 2) +
                                      std::pow(other.standard_uncertainty / other.value, 2));
    return one.value > other.value * (1.0 + clear * relative);
}

// By the smaller half of the differences, beside that of the draws.
Factor robust_factor(const Group& group, const Eigen::VectorXd& residuals, const Draws& noise) {
    if (int(group.differences.size()) < fewest_differences) return {1.0, INFINITY};
    Eigen::Array<double, draws, 1> of_noise;
    for (int k = 0; k < draws; ++k) of_noise[k] = std::sqrt(smaller_half(group, [&](int r) { return noise(r, k); }));
    const double mean = of_noise.mean();
    const double deviation = std::sqrt((of_noise - mean).square().sum() / (draws - 1));
    const double value = std::sqrt(smaller_half(group, [&](int r) { return residuals[r]; })) / mean;
    return {value, value * deviation / mean};
}

// By square sums.
std::vector<Factor> factors_of_squares(const std::vector<Group>& groups, const Eigen::VectorXd& residuals,
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
double weighed_with(const AdjustmentProblem& problem, const Group& group) {
    const AdjustedReading& reading = problem.readings()[group.readings.front()];
    return reading.standard_uncertainty / reading.noise;
}

// That chance makes a factor as large where it is 1: its square is a chi-square of so much freedom.
double probability_of_factor(const Factor& factor) {
    const double relative = factor.standard_uncertainty / std::max(factor.value, 1.0);
    const double freedom = 0.5 / (relative * relative);
    return chi_square_probability(factor.value * factor.value * freedom, freedom);
}

bool is_odd(const std::vector<Factor>& factors) {
    return std::any_of(factors.begin(), factors.end(), [](const Factor& factor) {
        return factor.value > 1.0 && probability_of_factor(factor) < odd_scatter;
    });
}

}  // namespace

std::vector<ScatterOfChannel> scatter_of_channels(Solution& solution, const std::vector<NoiseFactor>& weighed) {
    std::vector<Key> of_lines;
    for (const NoiseFactor& each : weighed)
        if (!each.line.empty()) of_lines.emplace_back(each.channel, each.line);
    std::vector<Group> groups = groups_of(solution, of_lines);
    const Eigen::VectorXd& residuals = solution.solver().equations().residuals();
    const auto by_squares = [&](std::vector<Draws>& noise) {
        std::vector<Group> controlled;
        for (Group& group : groups)
            if (group.freedom >= fewest_freedom) {
                noise.push_back(responses(solution, group.readings));
                controlled.push_back(std::move(group));
            }
        groups = std::move(controlled);
        return factors_of_squares(groups, residuals, noise);
    };
    std::vector<Draws> noise;
    std::vector<Factor> factors = by_squares(noise), robust = factors;
    if (is_odd(factors) || !weighed.empty()) {
        Draws all = Draws::Zero(residuals.size(), draws);
        for (const Draws& each : noise) all += each;
        for (std::size_t g = 0; g < groups.size(); ++g) robust[g] = robust_factor(groups[g], residuals, all);
        // Lines of a channel that scatter otherwise than its others.
        std::vector<Key> every;
        for (const LineSetup& setup : solution.problem().setups())
            for (const Group& group : groups) every.emplace_back(group.channel, setup.line.name());
        const std::size_t known = of_lines.size();
        for (const Group& of_line : groups_of(solution, every)) {
            const Factor factor = robust_factor(of_line, residuals, all);
            if (!(factor.standard_uncertainty < thresholds.widest_component * factor.value)) continue;
            for (std::size_t g = 0; g < groups.size(); ++g)
                if (groups[g].channel == of_line.channel && groups[g].line.empty() &&
                    is_clearly_larger(factor, robust[g], clear_of_lines))
                    of_lines.emplace_back(of_line.channel, of_line.line);
        }
        if (of_lines.size() > known) {
            groups = groups_of(solution, of_lines);
            noise.clear();
            factors = robust = by_squares(noise);
            for (std::size_t g = 0; g < groups.size(); ++g) robust[g] = robust_factor(groups[g], residuals, all);
        }
    }
    std::vector<ScatterOfChannel> scatter;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        ScatterOfChannel of;
        of.is_noise = !is_clearly_larger(factors[g], robust[g], clear_of_squares);
        const Factor& factor = of.is_noise ? factors[g] : robust[g];
        const double before = weighed_with(solution.problem(), groups[g]);
        const bool is_used = std::any_of(weighed.begin(), weighed.end(), [&](const NoiseFactor& each) {
            return each.channel == groups[g].channel && each.line == groups[g].line && each.factor > 1.0;
        });
        const Factor stated{before * factor.value, before * factor.standard_uncertainty};
        if (!std::isfinite(stated.standard_uncertainty)) continue;
        const bool is_known = stated.standard_uncertainty < thresholds.widest_component * std::max(1.0, stated.value);
        of.component = {
            {groups[g].channel, groups[g].line, stated.value}, stated.standard_uncertainty, is_used};
        // What was taken for noise stays so near the limit: otherwise nothing would come to rest there.
        const double limit = thresholds.noise_component * (is_used ? 10.0 : 1.0);
        if (stated.value > 1.0) of.probability = probability_of_factor(stated);
        of.is_significant = is_known && of.probability < limit;
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
