#include "simulation/pass_readings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"

namespace stepdiag {
namespace {

void check_options(const Plan& plan, const SimulationOptions& options) {
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
    }
    check_noise(options.noise);
    if (options.repeats < 1 || options.repeats > SimulationOptions::largest_repeat_count)
        throw InvalidArgument("repeats: expected 1 to " + std::to_string(SimulationOptions::largest_repeat_count) +
                              ", got " + std::to_string(options.repeats));
    if (const auto& seconds = options.seconds_per_reading; seconds && !(std::isfinite(*seconds) && *seconds > 0.0))
        throw InvalidArgument("seconds_per_reading: expected a finite time above 0");
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

void check_run(const Plan& plan, const Heads& heads, const SimulationOptions& options) {
    check_heads(heads, plan);
    check_options(plan, options);
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

// Whoever says what air is assumed means air; else usual_environment.
Environment true_environment(const Head& head, const SimulationOptions& options) {
    return options.environment.value_or(options.assumed ? Environment{Air{}} : usual_environment(head));
}

void check_misalignment(const Misalignment& misalignment, const Head& head, const Line& line) {
    const std::size_t given = misalignment.beam_constants.size(), beams = head.beam_offsets.size();
    if (given > 0 && (head.layout != HeadLayout::multi_beam || given != beams))
        throw InvalidArgument("misalignment of " + line.name() + ": expected " + std::to_string(beams) +
                              " beam constants, got " + std::to_string(given));
    if (misalignment.gain != 0.0 && head.design && head.layout == HeadLayout::multi_beam)
        throw InvalidArgument("misalignment of " + line.name() +
                              ": gain: expected 0, because the beams of a traced head stand where its design and its "
                              "pose errors put them");
}

Misalignment misalignment_of(const SimulationOptions& options, const Line& line) {
    const auto entry = options.misalignment.find(line.name());
    return entry == options.misalignment.end() ? Misalignment{} : entry->second;
}

TracedConditions traced_conditions(const Head& head, const SimulationOptions& options) {
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
std::vector<SignalRow> read_defined(Head head, const HeadSetup& setup, const std::vector<Pose>& poses,
                                    const Misalignment& misalignment, const SimulationOptions& options) {
    for (Eigen::Vector2d& offset : head.beam_offsets) offset *= 1.0 + misalignment.gain;
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

void add_setup(SignalRow& row, const std::vector<std::string>& channels, const Misalignment& misalignment,
               double elapsed) {
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) continue;
        double constant = 0.0;
        if (is_distance(channels[c]))
            constant = misalignment.distance_constant + misalignment.drift * elapsed +
                       (c < misalignment.beam_constants.size() ? misalignment.beam_constants[c] : 0.0);
        else *row[c] *= 1.0 + misalignment.gain;
        if (channels[c] == "spot_x" || channels[c] == "spot_y")
            constant = misalignment.psd_zero[channels[c] == "spot_y"];
        *row[c] += constant;
    }
}

void add_noise(SignalRow& row, const std::vector<std::string>& channels, const Noise& noise, std::uint64_t number) {
    constexpr std::uint64_t common_draw = 0xffff;  // no channel has this number
    const auto draw = [&](std::uint64_t c) {
        return normal_pair(noise.seed, RandomStream::reading_noise, (number << 16) | c)[0];
    };
    const double common = noise.common > 0.0 ? noise.common * draw(common_draw) : 0.0;
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) continue;
        if (is_distance(channels[c])) *row[c] += common;
        if (const double sigma = deviation(noise, channels[c]); sigma > 0.0) *row[c] += sigma * draw(c);
    }
}

}  // namespace stepdiag
