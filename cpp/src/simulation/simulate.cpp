#include "stepdiag/simulation/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"

namespace stepdiag {
namespace {

void check_options(const Plan& plan, const SimulationOptions& options) {
    for (const auto& [line, misalignment] : options.misalignment) {
        if (!plan.contains(Line::parse(line)))
            throw InvalidArgument("misalignment: line \"" + line + "\" is not in the plan");
        const auto small = [](const Eigen::Vector2d& angles) {
            return angles.allFinite() && angles.cwiseAbs().maxCoeff() < 0.1;
        };
        bool finite = misalignment.psd_zero.allFinite() && std::isfinite(misalignment.distance_constant);
        for (const double constant : misalignment.beam_constants) finite = finite && std::isfinite(constant);
        if (!small(misalignment.reflector) || !small(misalignment.laser) || !finite)
            throw InvalidArgument("misalignment of " + line + ": expected angles below 0.1 rad and finite lengths");
    }
    check_noise(options.noise);
    if (!(options.verified_share >= 0.0 && options.verified_share <= 1.0))
        throw InvalidArgument("verified_share: expected a share from 0 to 1");
}

double farthest_beam(const Head& head) {
    double farthest = 0.0;
    if (head.design)
        for (const HeadBeam& beam : head.design->beams)
            farthest = std::max(farthest, beam.placement.position.head<2>().cwiseAbs().maxCoeff());
    return farthest;
}

Eigen::Vector2d mirror_size(const Head& head, const Plan& plan) {
    const Eigen::Vector2d smallest = plan.smallest_mirror();
    if (!head.mirror) return smallest + Eigen::Vector2d::Constant(2.0 * (Head::mirror_margin + farthest_beam(head)));
    if ((*head.mirror - smallest).minCoeff() < 0.0) {
        std::ostringstream text;
        text << "head mirror: too small for this plan: expected at least " << smallest.x() << " x " << smallest.y()
             << " mm, got " << head.mirror->x() << " x " << head.mirror->y() << " mm";
        throw InvalidArgument(text.str());
    }
    return *head.mirror;
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

// Whoever says what air is assumed means air; else usual_environment.
Environment true_environment(const Head& head, const SimulationOptions& options) {
    return options.environment.value_or(options.assumed ? Environment{Air{}} : usual_environment(head));
}

void check_constants(const Misalignment& misalignment, const Head& head, const Line& line) {
    const std::size_t given = misalignment.beam_constants.size(), beams = head.beam_offsets.size();
    if (given > 0 && (head.layout != HeadLayout::multi_beam || given != beams))
        throw InvalidArgument("misalignment of " + line.name() + ": expected " + std::to_string(beams) +
                              " beam constants, got " + std::to_string(given));
}

TracedConditions conditions(const Head& head, const SimulationOptions& options) {
    return {options.environment.value_or(usual_environment(head)),
            options.assumed,
            {options.verified_share, options.noise.seed},
            options.noise.seed};
}

std::vector<SignalRow> read_traced(const TracedReader& reader, const HeadSetup& setup, const std::vector<Pose>& poses,
                                   std::uint64_t first_row, ReplayCount* count) {
    std::vector<MirrorPose> mirrors;
    for (const Pose& pose : poses) mirrors.push_back(mirror_in_sensor_frame(setup, pose.position, pose.rotation));
    return reader.read(mirrors, first_row, count);
}

bool is_distance(const std::string& channel) { return channel.front() == 'd'; }

// The ideal head, traced, and the closed definitions. The air's index is taken off the path with the assumed one.
std::vector<SignalRow> read_defined(const Head& head, const HeadSetup& setup, const std::vector<Pose>& poses,
                                    const SimulationOptions& options) {
    const Environment environment = true_environment(head, options);
    const Medium air{refractive_index(environment, head.wavelength)};
    const double assumed = refractive_index(options.assumed.value_or(environment), head.wavelength);
    const std::vector<std::string> names = signal_names(head);
    std::vector<SignalRow> rows;
    for (const Pose& pose : poses) {
        const auto reading = head.layout == HeadLayout::ideal
                                 ? trace_reading(head, setup, pose.position, pose.rotation, air)
                                 : define_reading(setup, pose.position, pose.rotation);
        SignalRow& row = rows.emplace_back(names.size());
        if (!reading) continue;
        const Eigen::VectorXd values = signals(head, *reading);
        for (std::size_t c = 0; c < row.size(); ++c) row[c] = values[Eigen::Index(c)];
        for (std::size_t c = 0; c < row.size(); ++c)
            if (is_distance(names[c])) *row[c] *= air.index / assumed;
    }
    return rows;
}

double deviation(const Noise& noise, const std::string& channel) {
    if (channel == "alpha" || channel == "beta") return noise.tilt;
    return channel == "spot_x" || channel == "spot_y" ? noise.spot : noise.distance;
}

// What a line's set-up adds to a row, and its noise.
void add_setup_and_noise(SignalRow& row, const std::vector<std::string>& channels, const Misalignment& misalignment,
                         const Noise& noise, std::uint64_t number) {
    constexpr std::uint64_t common_draw = 0xffff;  // no channel has this number
    const auto draw = [&](std::uint64_t c) {
        return normal_pair(noise.seed, RandomStream::reading_noise, (number << 16) | c)[0];
    };
    const double common = noise.common > 0.0 ? noise.common * draw(common_draw) : 0.0;
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) continue;
        double constant = 0.0;
        if (is_distance(channels[c]))
            constant = misalignment.distance_constant + common +
                       (c < misalignment.beam_constants.size() ? misalignment.beam_constants[c] : 0.0);
        else if (channels[c] == "spot_x" || channels[c] == "spot_y")
            constant = misalignment.psd_zero[channels[c] == "spot_y"];
        *row[c] += constant;
        if (const double sigma = deviation(noise, channels[c]); sigma > 0.0) *row[c] += sigma * draw(c);
    }
}

}  // namespace

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
    check_heads(heads, plan);
    check_options(plan, options);
    const std::vector<std::string> names = signal_names(heads.head);
    std::map<const Head*, TracedReader> readers;  // the common head is put together once

    std::vector<Station> stations;
    std::vector<Channel> channels;
    for (const std::string& name : names) channels.push_back({name, {}});
    std::vector<Line> lines = plan.lines();
    lines.insert(lines.end(), plan.scale_lines().begin(), plan.scale_lines().end());
    for (const Line& line : lines) {
        const Head& head = heads.of(line);
        const Eigen::Vector2d mirror = mirror_size(head, plan);
        const auto entry = options.misalignment.find(line.name());
        const Misalignment misalignment = entry == options.misalignment.end() ? Misalignment{} : entry->second;
        const auto points = plan.points(line);
        const HeadSetup setup =
            set_up(head, plan.frame(line), points.front().commanded + machine.tool(), mirror, misalignment);
        check_constants(misalignment, head, line);
        std::vector<Pose> poses;
        for (const PlanPoint& point : points) poses.push_back(machine.pose(point.commanded));

        const std::uint64_t first_row = stations.size();
        std::vector<SignalRow> rows;
        if (head.design) {
            const auto reader = readers.try_emplace(&head, head, mirror, conditions(head, options)).first;
            rows = read_traced(reader->second, setup, poses, first_row, count);
        } else {
            rows = read_defined(head, setup, poses, options);
        }
        for (std::size_t k = 0; k < points.size(); ++k) {
            add_setup_and_noise(rows[k], names, misalignment, options.noise, first_row + k);
            stations.push_back({0, line, int(k), Direction::forward, points[k].commanded});
            for (std::size_t c = 0; c < channels.size(); ++c) channels[c].value.push_back(rows[k][c]);
        }
    }
    return Measurement(std::move(stations), std::move(channels));
}

}  // namespace stepdiag
