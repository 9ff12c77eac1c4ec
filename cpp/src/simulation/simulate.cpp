#include "stepdiag/simulation/simulate.hpp"

#include <cmath>

#include "simulation/pass_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
void check_noise(const Noise& noise) {
    for (const auto& [key, deviation] : {std::pair("distance", noise.distance), std::pair("tilt", noise.tilt),
                                         std::pair("spot", noise.spot), std::pair("common", noise.common)})
        if (!(std::isfinite(deviation) && deviation >= 0.0))
            throw InvalidArgument(std::string("noise ") + key + ": expected a finite standard deviation, at least 0");
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

Measurement simulate(const Machine& machine, const Plan& plan, const Heads& heads, const SimulationOptions& options,
                     ReplayCount* count) {
    check_run(plan, heads, options);
    const std::vector<std::string> names = signal_names(heads.head);
    std::map<const Head*, TracedReader> readers;  // the common head is put together once

    std::vector<Station> stations;
    std::vector<Channel> channels;
    for (const std::string& name : names) channels.push_back({name, {}});
    const double seconds = options.seconds_per_reading.value_or(0.0);
    for (const PlannedPass& pass : planned_passes(plan, options.repeats, options.backward)) {
        const Line& line = pass.line;
        const Head& head = heads.of(line);
        const Eigen::Vector2d mirror = mirror_size(head, plan);
        const Misalignment misalignment = misalignment_of(options, line);
        check_misalignment(misalignment, head, line);
        const HeadSetup setup =
            set_up(head, plan.frame(line), plan.points(line, pass.run).front().commanded + machine.tool(), mirror,
                   misalignment);
        std::vector<Pose> poses;
        const std::vector<PlanPoint> points = points_of(plan, pass);
        for (std::size_t k = 0; k < points.size(); ++k) {
            const std::size_t point = pass.direction == Direction::forward ? k : points.size() - 1 - k;
            stations.push_back({pass.run, line, int(point), pass.direction, points[k].commanded});
            poses.push_back(machine.pose(points[k].commanded, approaches(line, pass.direction)));
        }

        std::vector<SignalRow> rows;
        if (head.design) {
            const auto reader = readers.try_emplace(&head, head, mirror, traced_conditions(head, options)).first;
            rows = read_traced(reader->second, setup, poses, pass.first_row, count);
        } else {
            rows = read_defined(head, setup, poses, misalignment, options);
        }
        for (std::size_t k = 0; k < rows.size(); ++k) {
            const std::uint64_t row = pass.first_row + k;
            const double elapsed = double(row - pass.setup_row) * seconds;
            add_setup(rows[k], names, misalignment, elapsed);
            add_noise(rows[k], names, options.noise, row);
            for (std::size_t c = 0; c < channels.size(); ++c) channels[c].value.push_back(rows[k][c]);
        }
    }
    if (options.seconds_per_reading) {
        Channel& time = channels.emplace_back(Channel{"time", {}});
        for (std::size_t row = 0; row < stations.size(); ++row) time.value.push_back(double(row) * seconds);
    }
    return Measurement(std::move(stations), std::move(channels));
}

}  // namespace stepdiag
