#include "stepdiag/simulation/simulate.hpp"

#include <cmath>
#include <limits>
#include <memory>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/simulation/pass_reader.hpp"

namespace stepdiag {
namespace {

void check_misalignment(const Misalignment& misalignment, const Head& head, const std::string& line) {
    const std::size_t given = misalignment.beam_constants.size(), beams = head.beam_offsets.size();
    if (given > 0 && (head.layout != HeadLayout::multi_beam || given != beams))
        throw InvalidArgument("misalignment of " + line + ": expected " + std::to_string(beams) +
                              " beam constants, got " + std::to_string(given));
    if (misalignment.gain != 0.0 && head.design && head.layout == HeadLayout::multi_beam)
        throw InvalidArgument("misalignment of " + line +
                              ": gain: expected 0, because the beams of a traced head stand where its design and its "
                              "pose errors put them");
}

void check_scales(const ScaleTemperatures& scales, bool has_times) {
    check(scales.expansion);
    if (!scales.start.allFinite() || !scales.rate.allFinite())
        throw InvalidArgument("scales: expected finite temperatures and rates");
    if (!scales.rate.isZero(0.0) && !has_times)
        throw InvalidArgument("scales: a temperature that changes: expected seconds_per_reading as well");
    const auto same = [](const Eigen::Vector3d& of_axes) { return (of_axes.array() == of_axes[0]).all(); };
    if (scales.one_sensor && !(same(scales.start) && same(scales.rate)))
        throw InvalidArgument("scales: one_sensor: expected the same temperature and rate for all axes");
}

void check_options(const Plan& plan, const Heads& heads, const SimulationOptions& options) {
    for (const auto& [line, misalignment] : options.misalignment) {
        if (!plan.contains(Line::parse(line)))
            throw InvalidArgument("misalignment: line \"" + line + "\" is not in the plan");
        if (!(std::abs(misalignment.gain) <= 0.5))
            throw InvalidArgument("misalignment of " + line + ": gain: expected a number from -0.5 to 0.5");
        const std::vector<double> numbers = setup_numbers(misalignment, int(misalignment.beam_constants.size()));
        for (int column = 0; column < int(numbers.size()); ++column) {
            const bool angle = record(setup::component(column).quantity).unit == "rad";
            if (!(std::abs(numbers[column]) < (angle ? 0.1 : std::numeric_limits<double>::infinity())))
                throw InvalidArgument("misalignment of " + line + ": expected angles below 0.1 rad and finite lengths");
        }
        if (misalignment.drift != 0.0 && !options.seconds_per_reading)
            throw InvalidArgument("misalignment of " + line + ": drift: expected seconds_per_reading as well");
        check_misalignment(misalignment, heads.of(Line::parse(line)), line);
    }
    check_noise(options.noise);
    if (options.scales) check_scales(*options.scales, options.seconds_per_reading.has_value());
    if (!options.machine_drift.allFinite()) throw InvalidArgument("machine_drift: expected three finite rates in mm/s");
    if (!options.machine_drift.isZero(0.0) && !options.seconds_per_reading)
        throw InvalidArgument("machine_drift: expected seconds_per_reading as well");
    if (options.repeats < 1 || options.repeats > SimulationOptions::largest_repeat_count)
        throw InvalidArgument("repeats: expected 1 to " + std::to_string(SimulationOptions::largest_repeat_count) +
                              ", got " + std::to_string(options.repeats));
    if (const auto& seconds = options.seconds_per_reading; seconds && !(std::isfinite(*seconds) && *seconds > 0.0))
        throw InvalidArgument("seconds_per_reading: expected a finite time above 0");
    if (!(options.verified_share >= 0.0 && options.verified_share <= 1.0))
        throw InvalidArgument("verified_share: expected a share from 0 to 1");
}

void check_heads(const Heads& heads, const Plan& plan) {
    check_head(heads.head);
    for (const auto& [line, head] : heads.by_line) {
        if (!plan.contains(Line::parse(line)))
            throw InvalidArgument("head of " + line + ": line \"" + line + "\" is not in the plan");
        check_head(head);
        if (signal_names(head) != signal_names(heads.head))
            throw InvalidArgument("head of " + line + ": expected the same signals as the other lines' heads");
    }
}

double deviation(const Noise& noise, const std::string& channel) {
    if (channel == "alpha" || channel == "beta") return noise.tilt;
    return channel == "spot_x" || channel == "spot_y" ? noise.spot : noise.distance;
}

}  // namespace

void check_noise(const Noise& noise) {
    for (const auto& [key, deviation] : {std::pair("distance", noise.distance), std::pair("tilt", noise.tilt),
                                         std::pair("spot", noise.spot), std::pair("common", noise.common)})
        if (!(std::isfinite(deviation) && deviation >= 0.0))
            throw InvalidArgument(std::string("noise ") + key + ": expected a finite standard deviation, at least 0");
}

void Noise::add(SignalRow& row, const std::vector<std::string>& signals, std::uint64_t number) const {
    constexpr std::uint64_t common_draw = 0xffff;  // no channel has this number
    const auto draw = [&](std::uint64_t c) {
        return normal_pair(seed, RandomStream::reading_noise, (number << 16) | c)[0];
    };
    const double of_all = common > 0.0 ? common * draw(common_draw) : 0.0;
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) continue;
        if (is_distance(signals[c])) *row[c] += of_all;
        if (const double sigma = deviation(*this, signals[c]); sigma > 0.0) *row[c] += sigma * draw(c);
    }
}

const Head& Heads::of(const Line& line) const {
    const auto found = by_line.find(line.name());
    return found == by_line.end() ? head : found->second;
}

HeadCalibrations Heads::calibration() const {
    HeadCalibrations calibrations(head.calibration());
    for (const auto& [line, own] : by_line) calibrations.by_line.emplace(line, own.calibration());
    return calibrations;
}

Misalignment SimulationOptions::misalignment_of(const Line& line) const {
    const auto entry = misalignment.find(line.name());
    return entry == misalignment.end() ? Misalignment{} : entry->second;
}

Eigen::Vector3d SimulationOptions::shift(const Eigen::Vector3d& commanded, std::uint64_t row) const {
    const double time = double(row) * seconds_per_reading.value_or(0.0);
    Eigen::Vector3d shift = time * machine_drift;
    if (scales) shift += scales->expansion.shift(commanded, scales->at(time));
    return shift;
}

Environment SimulationOptions::environment_of(const Head& head) const {
    return environment.value_or(assumed ? Environment{Air{}} : usual_environment(head));
}

ReadingConditions SimulationOptions::conditions_of(const Head& head) const {
    return {environment_of(head), assumed, {verified_share, noise.seed}, noise.seed};
}

void check_run(const Plan& plan, const Heads& heads, const SimulationOptions& options) {
    check_heads(heads, plan);
    check_options(plan, heads, options);
}

Measurement simulate(const Machine& machine, const Plan& plan, const Heads& heads, const SimulationOptions& options,
                     ReplayCount* count) {
    check_run(plan, heads, options);
    const std::vector<PlannedPass> passes = planned_passes(plan, options.repeats, options.backward);
    const std::vector<std::string> signals = signal_names(heads.head);
    std::map<const Head*, std::shared_ptr<const TracedReader>> traced;  // a head that lines share is built once
    std::vector<SignalRow> rows;
    for (const PlannedPass& pass : passes) {
        const LinePlace place = place_on_line(machine, plan, heads, pass.line);
        const PassReader reader(*place.head, place, options.misalignment_of(pass.line),
                                options.conditions_of(*place.head), traced[place.head]);
        traced[place.head] = reader.traced();
        std::vector<double> elapsed(pass.points.size());
        for (std::size_t k = 0; k < elapsed.size(); ++k)
            elapsed[k] = double(pass.first_row + k - pass.setup_row) * options.seconds_per_reading.value_or(0.0);
        for (SignalRow& row : reader.read(tool_poses(machine, pass, options), elapsed, pass.first_row, count)) {
            options.noise.add(row, signals, rows.size());
            rows.push_back(std::move(row));
        }
    }
    return as_measured(passes, signals, rows, options);
}

Measurement as_measured(const std::vector<PlannedPass>& passes, const std::vector<std::string>& signals,
                        const std::vector<SignalRow>& rows, const SimulationOptions& options) {
    std::vector<Station> stations;
    for (const PlannedPass& pass : passes)
        for (const PlanPoint& point : pass.points)
            stations.push_back({pass.run, pass.line, point.number, pass.direction, point.commanded});
    std::vector<Channel> channels;
    for (std::size_t c = 0; c < signals.size(); ++c) {
        Channel& channel = channels.emplace_back(Channel{signals[c], {}});
        for (const SignalRow& row : rows) channel.value.push_back(row[c]);
    }
    const double seconds = options.seconds_per_reading.value_or(0.0);
    const auto record = [&](const char* name, const auto& value_at) {
        Channel& channel = channels.emplace_back(Channel{name, {}});
        for (std::size_t row = 0; row < rows.size(); ++row) channel.value.push_back(value_at(double(row) * seconds));
    };
    if (options.seconds_per_reading) record("time", [](double time) { return time; });
    if (const auto& scales = options.scales) {
        const char* const names[] = {"temperature_x", "temperature_y", "temperature_z"};
        if (scales->one_sensor) record("temperature", [&](double time) { return scales->at(time)[0]; });
        else
            for (int a = 0; a < 3; ++a) record(names[a], [&](double time) { return scales->at(time)[a]; });
    }
    return Measurement(std::move(stations), std::move(channels));
}

}  // namespace stepdiag
