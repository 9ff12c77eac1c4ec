#include "uncertainty/run_model.hpp"

#include <algorithm>
#include <cmath>

#include "head/assembly.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Where a quantity begins among the shared numbers; none for those of parts.
std::optional<int> shared_column(SharedQuantity quantity) {
    switch (quantity) {
        case SharedQuantity::psd_distance: return shared_field::psd_distance;
        case SharedQuantity::beam_offset: return shared_field::beam_offset;
        case SharedQuantity::reading_model: return shared_field::reading_model;
        case SharedQuantity::temperature: return shared_field::temperature;
        case SharedQuantity::pressure: return shared_field::pressure;
        case SharedQuantity::humidity: return shared_field::humidity;
        case SharedQuantity::refractive_index: return shared_field::refractive_index;
        case SharedQuantity::wavelength: return shared_field::wavelength;
        case SharedQuantity::machine_drift: return shared_field::machine_drift;
        case SharedQuantity::expansion:
        case SharedQuantity::common_expansion: return shared_field::expansion;
        case SharedQuantity::scale_temperature:
        case SharedQuantity::common_scale_temperature: return shared_field::scale_temperature;
        case SharedQuantity::scale_ramp:
        case SharedQuantity::common_scale_ramp: return shared_field::scale_ramp;
        default: return std::nullopt;
    }
}

// A caller's own times come first; temperatures that change need them.
SimulationOptions with_times(SimulationOptions options, double seconds) {
    const bool stays = !options.scales || options.scales->rate.isZero(0.0);
    if (stays && !options.seconds_per_reading) options.seconds_per_reading = seconds;
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

RunModel::RunModel(const VirtualRun& given, std::uint64_t seed) : run(given), draws(run.inputs, seed) {
    if (!(std::isfinite(run.seconds_per_reading) && run.seconds_per_reading > 0.0))
        throw InvalidArgument("seconds_per_reading: expected a finite time above 0");
    seconds = run.simulation.seconds_per_reading.value_or(run.seconds_per_reading);
    check_run(run.plan, run.heads, with_times(run.simulation, seconds));
    channels = signal_names(run.heads.head);
    beams = run.heads.head.layout == HeadLayout::multi_beam ? int(channels.size()) : 0;

    for (const PlannedPass& pass : planned_passes(run.plan, run.simulation.repeats, run.simulation.backward)) {
        if (pass.line_index == lines.size())
            lines.push_back({setup_numbers(run.simulation.misalignment_of(pass.line), beams), {}});
        const LinePlace place = place_on_line(run.machine, run.plan, run.heads, pass.line);
        const bool forward = pass.direction == Direction::forward;
        const Eigen::Vector3d first = (forward ? pass.points.front() : pass.points.back()).commanded;
        const Eigen::Vector3d last = (forward ? pass.points.back() : pass.points.front()).commanded;
        for (const PlanPoint& point : pass.points) {
            const double travel = place.frame.col(2).dot(point.commanded - first);
            const double share = run.plan.is_scale_line(pass.line) ? travel / (last - first).norm()
                                                                   : point.number + 1 == int(pass.points.size());
            RunRow row{double(rows.size() - pass.setup_row) * seconds, travel, share};
            if (const auto& scales = run.simulation.scales) {
                row.warmth = scales->at(double(rows.size()) * seconds).array() - scales->expansion.reference;
                row.from_fixed = point.commanded - scales->expansion.fixed_point;
            }
            rows.push_back(row);
        }
        for (const Pose& pose : tool_poses(run.machine, pass, run.simulation)) poses.push_back(pose);
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
    if (const auto* quantity = std::get_if<SetupQuantity>(&input.quantity)) {
        const auto [first, count] = setup::columns(*quantity, beams);
        check_component(what, input.component, count);
        const auto pass = std::find_if(passes.begin(), passes.end(),
                                       [&](const RunPass& v) { return v.planned.line.name() == input.line; });
        if (pass == passes.end()) throw InvalidArgument(what + ": line \"" + input.line + "\" is not in the plan");
        if (*quantity == SetupQuantity::psd_zero && pass->place.head->layout != HeadLayout::psd)
            throw InvalidArgument(what + ": expected a head of layout psd");
        if (*quantity == SetupQuantity::gain && pass->place.head->design && beams > 0)
            throw InvalidArgument(what +
                                  ": the beams of a traced head stand where its design and its pose errors put "
                                  "them");
        lines[pass->planned.line_index].uncertain.push_back({first + input.component, index});
        return;
    }
    const SharedQuantity quantity = std::get<SharedQuantity>(input.quantity);
    if (const auto column = shared_column(quantity)) {
        check_component(what, input.component, record(quantity).count(beams));
        const bool of_closed_head = quantity == SharedQuantity::psd_distance || quantity == SharedQuantity::beam_offset;
        const bool of_air = quantity == SharedQuantity::temperature || quantity == SharedQuantity::pressure ||
                            quantity == SharedQuantity::humidity;
        for (const RunPass& pass : passes) {
            if (of_closed_head && pass.place.head->design)
                throw InvalidArgument(what +
                                      ": expected a head without a design; components of a design are moved by "
                                      "part_shift and part_rotation");
            if (quantity == SharedQuantity::psd_distance && pass.place.head->layout != HeadLayout::psd)
                throw InvalidArgument(what + ": expected a head of layout psd");
            if (of_air && !std::holds_alternative<Air>(run.simulation.environment_of(*pass.place.head).air))
                throw InvalidArgument(what + ": expected a state of the air as environment, got a constant index");
        }
        const bool of_scales = *column >= shared_field::expansion && *column <= shared_field::scale_ramp;
        if (of_scales && !run.simulation.scales)
            throw InvalidArgument(what + ": expected scales that expand, the run has none");
        const bool of_all_axes = quantity == SharedQuantity::common_expansion ||
                                 quantity == SharedQuantity::common_scale_temperature ||
                                 quantity == SharedQuantity::common_scale_ramp;
        for (int axis = 0; axis < (of_all_axes ? 3 : 1); ++axis)
            shared.uncertain.push_back({*column + input.component + axis, index});
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
    const int turned = quantity == SharedQuantity::part_rotation ? 3 : 0;
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
           shared.is_uncertain(shared_field::machine_drift, 3) || has_uncertain_scales();
}

bool RunModel::has_uncertain_scales() const { return shared.is_uncertain(shared_field::expansion, 9); }

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
