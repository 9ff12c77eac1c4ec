#include "uncertainty/run_model.hpp"

#include <algorithm>
#include <cmath>

#include "head/assembly.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

std::vector<double> numbers_of(const Misalignment& misalignment, std::size_t beams) {
    std::vector<double> numbers(field::beam_constant + beams, 0.0);
    for (int k = 0; k < 2; ++k) {
        numbers[field::reflector + k] = misalignment.reflector[k];
        numbers[field::laser + k] = misalignment.laser[k];
        numbers[field::lateral + k] = misalignment.lateral[k];
        numbers[field::psd_zero + k] = misalignment.psd_zero[k];
    }
    numbers[field::roll] = misalignment.roll;
    numbers[field::gain] = misalignment.gain;
    numbers[field::distance_constant] = misalignment.distance_constant;
    numbers[field::drift] = misalignment.drift;
    std::copy(misalignment.beam_constants.begin(), misalignment.beam_constants.end(),
              numbers.begin() + field::beam_constant);
    return numbers;
}

// Where a quantity of a line's set-up stands, and how many components it has; none for other quantities.
struct Place {
    int first;
    int count;
};
std::optional<Place> place_in_line(InputQuantity quantity, int beams) {
    switch (quantity) {
        case InputQuantity::reflector: return Place{field::reflector, 2};
        case InputQuantity::laser: return Place{field::laser, 2};
        case InputQuantity::psd_zero: return Place{field::psd_zero, 2};
        case InputQuantity::distance_constant: return Place{field::distance_constant, 1};
        case InputQuantity::beam_constant: return Place{field::beam_constant, beams};
        case InputQuantity::lateral: return Place{field::lateral, 2};
        case InputQuantity::roll: return Place{field::roll, 1};
        case InputQuantity::gain: return Place{field::gain, 1};
        case InputQuantity::drift: return Place{field::drift, 1};
        case InputQuantity::scale_length: return Place{field::scale_length, 1};
        case InputQuantity::scale_factor: return Place{field::scale_factor, 1};
        default: return std::nullopt;
    }
}

std::optional<Place> place_in_shared(InputQuantity quantity, int beams) {
    switch (quantity) {
        case InputQuantity::psd_distance: return Place{shared_field::psd_distance, 1};
        case InputQuantity::beam_offset: return Place{shared_field::beam_offset, 2 * beams};
        case InputQuantity::reading_model: return Place{shared_field::reading_model, 1};
        case InputQuantity::temperature: return Place{shared_field::temperature, 1};
        case InputQuantity::pressure: return Place{shared_field::pressure, 1};
        case InputQuantity::humidity: return Place{shared_field::humidity, 1};
        case InputQuantity::refractive_index: return Place{shared_field::refractive_index, 1};
        case InputQuantity::wavelength: return Place{shared_field::wavelength, 1};
        case InputQuantity::machine_drift: return Place{shared_field::machine_drift, 3};
        default: return std::nullopt;
    }
}

// A caller's own times come first.
SimulationOptions with_times(SimulationOptions options, double seconds) {
    if (!options.seconds_per_reading) options.seconds_per_reading = seconds;
    return options;
}

void check_component(const std::string& name, int component, int count) {
    if (count == 0) throw InvalidArgument(name + ": this run has no such quantity");
    if (component < 0 || component >= count)
        throw InvalidArgument(name + ": expected a component from 0 to " + std::to_string(count - 1) + ", got " +
                              std::to_string(component));
}

}  // namespace

bool Fields::is_uncertain(int first, int count) const {
    return std::any_of(uncertain.begin(), uncertain.end(),
                       [&](const Deviating& each) { return each.field >= first && each.field < first + count; });
}

bool Fields::acts(int first, int count) const {
    return is_uncertain(first, count) ||
           std::any_of(nominal.begin() + first, nominal.begin() + first + count, [](double x) { return x != 0.0; });
}

std::vector<double> Fields::with(const Eigen::VectorXd& deviations) const {
    std::vector<double> numbers = nominal;
    for (const Deviating& each : uncertain) numbers[std::size_t(each.field)] += deviations[each.input];
    return numbers;
}

Misalignment misalignment_of(const std::vector<double>& n) {
    return {{n[field::reflector], n[field::reflector + 1]},
            {n[field::laser], n[field::laser + 1]},
            {n[field::psd_zero], n[field::psd_zero + 1]},
            n[field::distance_constant],
            {n.begin() + field::beam_constant, n.end()},
            {n[field::lateral], n[field::lateral + 1]},
            n[field::roll],
            n[field::gain],
            n[field::drift]};
}

RunModel::RunModel(const VirtualRun& given, std::uint64_t seed) : run(given), draws(run.inputs, seed) {
    if (!(std::isfinite(run.seconds_per_reading) && run.seconds_per_reading > 0.0))
        throw InvalidArgument("seconds_per_reading: expected a finite time above 0");
    seconds = run.simulation.seconds_per_reading.value_or(run.seconds_per_reading);
    check_run(run.plan, run.heads, with_times(run.simulation, seconds));
    channels = signal_names(run.heads.head);
    const int beams = run.heads.head.layout == HeadLayout::multi_beam ? int(channels.size()) : 0;

    for (const PlannedPass& pass : planned_passes(run.plan, run.simulation.repeats, run.simulation.backward)) {
        if (pass.line_index == lines.size())
            lines.push_back({numbers_of(run.simulation.misalignment_of(pass.line), std::size_t(beams)), {}});
        const LinePlace place = place_on_line(run.machine, run.plan, run.heads, pass.line);
        const bool forward = pass.direction == Direction::forward;
        const Eigen::Vector3d first = (forward ? pass.points.front() : pass.points.back()).commanded;
        for (const PlanPoint& point : pass.points)
            rows.push_back({double(rows.size() - pass.setup_row) * seconds,
                            place.frame.col(2).dot(point.commanded - first),
                            point.number + 1 == int(pass.points.size())});
        for (const Pose& pose : tool_poses(run.machine, pass)) poses.push_back(pose);
        passes.push_back({pass, place});
    }
    if (rows.size() > Draws::most_rows)
        throw InvalidArgument("virtual run: expected at most " + std::to_string(Draws::most_rows) + " rows");
    shared.nominal.assign(shared_field::beam_offset + 2 * std::size_t(beams), 0.0);
    for (std::size_t i = 0; i < run.inputs.inputs.size(); ++i) add_input(run.inputs.inputs[i], int(i));
    check_noises();
}

void RunModel::add_input(const UncertainInput& input, int index) {
    const std::string what = name(input);
    const int beams = run.heads.head.layout == HeadLayout::multi_beam ? int(channels.size()) : 0;
    if (const auto place = place_in_line(input.quantity, beams)) {
        check_component(what, input.component, place->count);
        const auto pass = std::find_if(passes.begin(), passes.end(),
                                       [&](const RunPass& v) { return v.planned.line.name() == input.line; });
        if (pass == passes.end()) throw InvalidArgument(what + ": line \"" + input.line + "\" is not in the plan");
        if (input.quantity == InputQuantity::psd_zero && pass->place.head->layout != HeadLayout::psd)
            throw InvalidArgument(what + ": expected a head of layout psd");
        if (input.quantity == InputQuantity::gain && pass->place.head->design && beams > 0)
            throw InvalidArgument(what +
                                  ": the beams of a traced head stand where its design and its pose errors put "
                                  "them");
        lines[pass->planned.line_index].uncertain.push_back({place->first + input.component, index});
        return;
    }
    if (const auto place = place_in_shared(input.quantity, beams)) {
        check_component(what, input.component, place->count);
        const bool of_closed_head =
            input.quantity == InputQuantity::psd_distance || input.quantity == InputQuantity::beam_offset;
        const bool of_air = input.quantity == InputQuantity::temperature || input.quantity == InputQuantity::pressure ||
                            input.quantity == InputQuantity::humidity;
        for (const RunPass& pass : passes) {
            if (of_closed_head && pass.place.head->design)
                throw InvalidArgument(what +
                                      ": expected a head without a design; components of a design are moved by "
                                      "part_shift and part_rotation");
            if (input.quantity == InputQuantity::psd_distance && pass.place.head->layout != HeadLayout::psd)
                throw InvalidArgument(what + ": expected a head of layout psd");
            if (of_air && !std::holds_alternative<Air>(run.simulation.environment_of(*pass.place.head).air))
                throw InvalidArgument(what + ": expected a state of the air as environment, got a constant index");
        }
        shared.uncertain.push_back({place->first + input.component, index});
        return;
    }
    check_component(what, input.component, 3);
    const auto has_part = [&](const RunPass& pass) {
        if (!pass.place.head->design) return false;
        const auto names = component_names(*pass.place.head->design);
        return std::find(names.begin(), names.end(), input.part) != names.end();
    };
    if (std::none_of(passes.begin(), passes.end(), has_part))
        throw InvalidArgument(what + ": no head of this run has a component \"" + input.part + "\"");
    const int turned = input.quantity == InputQuantity::part_rotation ? 3 : 0;
    moved_parts.push_back({input.part, turned + input.component, index});
}

void RunModel::check_noises() const {
    for (const ReadingNoise& noise : run.inputs.noise) {
        const std::string what = name(noise);
        if (noise.quantity == NoiseQuantity::channel) {
            if (std::find(channels.begin(), channels.end(), noise.channel) == channels.end())
                throw InvalidArgument(what + ": the head has no channel \"" + noise.channel + "\"");
            continue;
        }
        const bool of_poses = noise.quantity == NoiseQuantity::machine_walk ||
                              noise.quantity == NoiseQuantity::position || noise.quantity == NoiseQuantity::orientation;
        check_component(what, noise.component, of_poses ? 3 : 1);
    }
}

bool RunModel::has(NoiseQuantity quantity) const {
    return std::any_of(run.inputs.noise.begin(), run.inputs.noise.end(),
                       [&](const ReadingNoise& noise) { return noise.quantity == quantity; });
}

bool RunModel::moves_poses() const {
    return has(NoiseQuantity::machine_walk) || has(NoiseQuantity::position) || has(NoiseQuantity::orientation) ||
           shared.is_uncertain(shared_field::machine_drift, 3);
}

bool RunModel::has_uncertain_air() const { return shared.is_uncertain(shared_field::temperature, 4); }

Environment RunModel::environment(const Head& head, const std::vector<double>& numbers) const {
    Environment environment = run.simulation.environment_of(head);
    environment.relative_error += numbers[shared_field::refractive_index];
    if (Air* air = std::get_if<Air>(&environment.air)) {
        air->temperature += numbers[shared_field::temperature];
        air->pressure += numbers[shared_field::pressure];
        air->relative_humidity += numbers[shared_field::humidity];
    }
    return environment;
}

Environment RunModel::assumed(const Head& head) const {
    return run.simulation.assumed.value_or(run.simulation.environment_of(head));
}

Head RunModel::head(const Head& nominal, const std::vector<double>& numbers, const Eigen::VectorXd& deviations) const {
    Head head = nominal;
    if (!head.design) {
        head.psd_distance += numbers[shared_field::psd_distance];
        if (head.layout == HeadLayout::multi_beam)
            for (std::size_t i = 0; i < head.beam_offsets.size(); ++i)
                head.beam_offsets[i] += Eigen::Vector2d(numbers[shared_field::beam_offset + 2 * i],
                                                        numbers[shared_field::beam_offset + 2 * i + 1]);
        return head;
    }
    const std::vector<std::string> names = component_names(*head.design);
    for (const MovedPart& part : moved_parts) {
        if (std::find(names.begin(), names.end(), part.component) == names.end()) continue;
        PoseError& error = head.pose_errors[part.component];
        (part.number < 3 ? error.shift : error.rotation)[part.number % 3] += deviations[part.input];
    }
    return head;
}

}  // namespace stepdiag
