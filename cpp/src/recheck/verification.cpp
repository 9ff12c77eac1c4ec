#include "stepdiag/recheck/verification.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "evaluation/fit_test.hpp"
#include "recheck/prediction.hpp"
#include "recheck/same_machine.hpp"
#include "recheck/wrong_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Within which set-ups are found, whether or not the machine is as the calibration says: ten times what is usual.
constexpr ChangePriors largest_change{300e-6, 50e-3, 300e-6, 500e-6};

// The first and the last point of each pass that have a distance.
std::vector<LineDeviation> line_deviations(const Measurement& measurement, const AdjustmentProblem& problem,
                                           const Prediction& prediction) {
    struct Ends {
        std::size_t row;                                   // of the pass, the first
        int first, last;                                   // points of the line
        std::map<int, int> first_distance, last_distance;  // reading by channel
    };
    std::map<std::tuple<int, int, bool>, Ends> passes;  // by set-up, run and direction
    for (const AdjustedPoint& point : problem.points()) {
        std::map<int, int> distances;
        for (int r = point.first_reading; r < point.end_reading; ++r)
            if (problem.readings()[r].used() && problem.channel_name(problem.readings()[r]).front() == 'd')
                distances[problem.readings()[r].channel] = r;
        if (distances.empty()) continue;
        const std::size_t row = problem.readings()[point.first_reading].row;
        const Station& station = measurement.stations()[row];
        const auto [place, is_new] =
            passes.try_emplace({point.setup, station.run, station.direction == Direction::backward},
                               Ends{row, station.point, station.point, distances, distances});
        Ends& ends = place->second;
        ends.row = std::min(ends.row, row);
        if (station.point < ends.first)
            std::tie(ends.first, ends.first_distance) = std::tuple(station.point, distances);
        if (station.point > ends.last) std::tie(ends.last, ends.last_distance) = std::tuple(station.point, distances);
    }
    std::map<std::size_t, LineDeviation> by_row;
    for (const auto& [key, ends] : passes) {
        std::vector<Prediction::Term> sum;
        for (const auto& [channel, reading] : ends.last_distance)
            if (const auto other = ends.first_distance.find(channel);
                other != ends.first_distance.end() && other->second != reading) {
                sum.push_back({reading, 1.0});
                sum.push_back({other->second, -1.0});
            }
        if (sum.empty()) continue;
        for (Prediction::Term& term : sum) term.weight *= 2.0 / double(sum.size());
        const auto [value, uncertainty] = prediction.deviation(sum);
        const auto& [setup, run, backward] = key;
        by_row[ends.row] = {run, problem.setups()[setup].line.name(), backward, value, uncertainty};
    }
    std::vector<LineDeviation> lines;
    for (const auto& entry : by_row) lines.push_back(entry.second);
    return lines;
}

Judgement<Verification> verified(const Measurement& measurement, const AdjustmentProblem& problem,
                                 const Baseline& baseline, const MotorShifts& sent) {
    Prediction prediction(problem, baseline, sent);
    prediction.solve();
    prediction.drop_changes();
    const Eigen::Index own = baseline.own_columns(), changes = Eigen::Index(baseline.changes().size());
    const ChiSquare fit = prediction.fit(own, baseline.root().cols() - changes - own);

    Verification result{{}, line_deviations(measurement, problem, prediction), fit.square_sum, fit.freedom, 1.0, 0};
    if (fit.freedom > 0) result.probability = chi_square_probability(fit.square_sum, fit.freedom);
    for (int r = 0; r < int(problem.readings().size()); ++r) {
        const AdjustedReading& reading = problem.readings()[r];
        if (!reading.used()) continue;
        const auto [value, uncertainty] = prediction.deviation({{r, 1.0}});
        result.readings.push_back({reading.row, problem.channel_name(reading), value, uncertainty});
    }
    std::stable_sort(result.readings.begin(), result.readings.end(),
                     [](const auto& a, const auto& b) { return a.row < b.row; });
    const auto worst = std::max_element(
        result.readings.begin(), result.readings.end(),
        [](const auto& a, const auto& b) { return std::abs(a.normalised()) < std::abs(b.normalised()); });
    result.worst = std::size_t(worst - result.readings.begin());
    const double probability = result.probability;
    const bool is_asked = probability < readings_asked_below;
    std::vector<Misfit> misfits;
    double square_sum = fit.square_sum;
    if (is_asked) {
        constexpr std::size_t tried = 5;
        const Baseline changing(baseline.calibration(), ChangePriors{}, read_positions(problem));
        Prediction changed(problem, changing, sent);
        changed.solve();
        misfits = largest_misfits(problem, changed, tried);
        square_sum = changed.chi_square();
    }
    return {std::move(result), fit, probability, is_asked, std::move(misfits), square_sum, prediction.missed()};
}

}  // namespace

Verification verify(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                    const Chain& chain, const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                    const AdjustmentOptions& options, const MotorShifts& sent) {
    if (!sent.empty() && sent.size() != measurement.size())
        throw InvalidArgument("sent: expected a shift for each of " + std::to_string(measurement.size()) +
                              " rows, got " + std::to_string(sent.size()));
    AdjustmentProblem problem = problem_of_known_machine(calibration, measurement, plan, chain, tool, heads, options);
    const Baseline baseline(calibration, largest_change, read_positions(problem));
    return judge_without_wrong_readings(
        {measurement, plan, chain, tool, heads, options}, problem,
        [&](const AdjustmentProblem& rest) { return verified(measurement, rest, baseline, sent); });
}

}  // namespace stepdiag
