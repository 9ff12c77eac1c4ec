#include "uncertainty/beam_paths.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "head/assembly.hpp"
#include "stepdiag/core/error.hpp"
#include "uncertainty/simd_pass.hpp"

namespace stepdiag {
namespace {

// Their paths lie about 2.5 standard deviations to each side of the nominal ones, and must have as much room again.
constexpr std::uint64_t route_samples = 32;
constexpr double beyond_the_pilot = 1.0;

bool reads_axes_alone(const HeadDesign& design) {
    for (const HeadBeam& beam : design.beams)
        if (beam.interferometer &&
            (beam.interferometer->model != ReadingModel::chief_ray || beam.interferometer->periodic_amplitude != 0.0 ||
             beam.interferometer->resolution > 0.0))
            return false;
    for (const SpotSensor& sensor : design.sensors) {
        const auto* device = std::get_if<LateralEffect>(&sensor.device);
        if (!device || device->noise > 0.0 || device->resolution > 0.0) return false;
    }
    return true;
}

// The largest angle by which the machine's errors turn the tool.
double largest_turn(const RunModel& model) {
    double largest = 0.0;
    for (const Pose& pose : model.poses) largest = std::max(largest, Eigen::AngleAxisd(pose.rotation).angle());
    return largest;
}

Outline mirror_outline(const RunModel& model, const Eigen::Vector2d& size) {
    constexpr double largest_repeatability = 1e-3;  // rad: beyond, lanes are not followed (simd_pass.cpp)
    const double turn =
        largest_turn(model) + (model.has(NoiseQuantity::orientation) ? largest_repeatability : 0.0) + 1e-9;
    const Eigen::Vector2d half = 0.5 * size - Eigen::Vector2d::Constant(0.5 * size.norm() * turn);
    return {{}, true, half.cwiseMax(0.0), {}};
}

std::vector<MovedComponent> moved_components(const RunModel& model, const Head& head) {
    std::vector<MovedComponent> all;
    const std::vector<std::string> names = component_names(*head.design);
    const std::vector<Placement> placements = component_placements(*head.design);
    const Eigen::VectorXd expectations = model.draws.expectations();
    const std::vector<double> expected(expectations.begin(), expectations.end());
    for (std::size_t c = 0; c < names.size(); ++c) {
        MovedComponent moved{int(c), placements[c], error_of(head.pose_errors, names[c]), {}, {}};
        for (const MovedPart& part : model.moved_parts)
            if (part.component == names[c]) moved.inputs.push_back({part.number, part.input});
        if (moved.inputs.empty()) continue;
        moved.expected = moved.at(expected);
        all.push_back(moved);
    }
    return all;
}

// Of a pass's rows those whose mirror stands farthest to each side, nearest and farthest, or is turned most.
std::vector<MirrorPose> outermost(const RunModel& model, const RunPass& pass, const Eigen::VectorXd& deviations) {
    const Misalignment misalignment = misalignment_of(model.lines[pass.planned.line_index].with(deviations));
    const HeadSetup setup =
        set_up(*pass.place.head, pass.place.frame, pass.place.first_point, pass.place.mirror, misalignment);
    std::vector<MirrorPose> all, chosen;
    for (std::size_t k = 0; k < pass.rows(); ++k) {
        const Pose& pose = model.poses[pass.first_row() + k];
        all.push_back(mirror_in_sensor_frame(setup, pose.position, pose.rotation));
    }
    for (int number = 0; number < 5; ++number) {
        const auto value = [&](const MirrorPose& m) {
            return number < 3 ? m.point[number] : m.rotation(number - 3, 2);
        };
        const auto ends = std::minmax_element(
            all.begin(), all.end(), [&](const MirrorPose& a, const MirrorPose& b) { return value(a) < value(b); });
        chosen.push_back(*ends.first);
        chosen.push_back(*ends.second);
    }
    return chosen;
}

TracedHead traced_at(const RunModel& model, const Head& head, const Eigen::Vector2d& mirror,
                     const Eigen::VectorXd& deviations) {
    const std::vector<double> shared = model.shared.with(deviations);
    const Head moved = model.head(head, shared, deviations);
    return TracedHead(*moved.design, moved.pose_errors, model.environment(head, shared), mirror);
}

// The segments of the rays that take this path at the mirror poses.
void add_segments(const TracedHead& traced, const BeamPath& path, const std::vector<MirrorPose>& mirrors,
                  std::vector<std::vector<Segment>>& segments) {
    for (const MirrorPose& mirror : mirrors) {
        const RayTree tree = traced.trace(path.beam, mirror);
        const std::vector<int> wanted = traced.wanted_segments(tree, path.beam);
        if (!wanted.empty() && same_faces(record_route(tree, wanted.front()), path.route))
            segments.push_back(path_segments(tree, wanted.front()));
    }
}

std::optional<BeamPath> record_path(const TracedHead& traced, const std::vector<MirrorPose>& mirrors, int beam) {
    const TracedHead::BeamOptics& optics = traced.optics(beam);
    for (const MirrorPose& mirror : mirrors) {
        const RayTree tree = traced.trace(beam, mirror);
        const std::vector<int> wanted = traced.wanted_segments(tree, beam);
        if (wanted.empty()) continue;
        const RecordedRoute route = record_route(tree, wanted.front());
        if (optics.designed.encounters.empty() || !same_faces(route, optics.designed)) continue;
        const auto meets_mirror = [&](const RecordedEncounter& met) { return met.face == traced.mirror_face(); };
        if (std::count_if(route.encounters.begin(), route.encounters.end(), meets_mirror) != 1) return std::nullopt;
        const auto at = std::find_if(route.encounters.begin(), route.encounters.end(), meets_mirror);
        const HeadDesign& design = traced.design();
        const HeadBeam& light = design.beams[std::size_t(beam)];
        const int source = int(design.bodies.size()) + beam;
        const int detector =
            light.interferometer ? source : int(design.bodies.size() + design.beams.size() + sensor_of(design, light));
        return BeamPath{beam,
                        0,
                        light.mode.wavelength,
                        optics.source,
                        optics.detector,
                        optics.air.index,
                        route,
                        std::size_t(at - route.encounters.begin()),
                        optics.frames,
                        optics.outlines,
                        optics.component,
                        source,
                        detector};
    }
    return std::nullopt;
}

bool is_bright_enough(const HeadDesign& design, const BeamPath& path) {
    const HeadBeam& light = design.beams[std::size_t(path.beam)];
    if (light.interferometer) return true;
    const auto& device = std::get<LateralEffect>(design.sensors[sensor_of(design, light)].device);
    return path.route.power >= device.least_power;
}

// Whether no other face comes near the paths, at the outermost poses of all passes with this head and of some samples.
bool is_clear(const RunModel& model, const Head& head, const Eigen::Vector2d& mirror, const TracedHead& traced,
              const std::vector<BeamPath>& paths) {
    std::vector<std::vector<std::vector<Segment>>> segments(paths.size());
    const auto add = [&](const TracedHead& own, const Eigen::VectorXd& deviations) {
        for (const RunPass& pass : model.passes)
            if (pass.place.head == &head && pass.planned.first_row == pass.planned.setup_row)
                for (std::size_t w = 0; w < paths.size(); ++w)
                    add_segments(own, paths[w], outermost(model, pass, deviations), segments[w]);
    };
    add(traced, model.draws.expectations());
    const bool same_head = model.moved_parts.empty() && !model.has_uncertain_air();
    for (std::uint64_t sample = 0; sample < route_samples; ++sample) {
        const Eigen::VectorXd deviations = model.draws.inputs(sample);
        try {
            if (same_head) add(traced, deviations);
            else add(traced_at(model, head, mirror, deviations), deviations);
        } catch (const InvalidArgument&) {  // air out of range: a sample without result
        }
    }
    for (std::size_t w = 0; w < paths.size(); ++w)
        if (!segments[w].empty() && !pass_clear(segments[w], traced.optics(paths[w].beam).fixed, paths[w].component,
                                                paths[w].source_component, beyond_the_pilot))
            return false;
    return true;
}

}  // namespace

Placement MovedComponent::at(const std::vector<double>& deviations) const {
    PoseError error = nominal;
    for (const auto& [number, input] : inputs)
        (number < 3 ? error.shift : error.rotation)[number % 3] += deviations[std::size_t(input)];
    return moved(designed, error);
}

std::optional<HeadPaths> record_paths(const RunModel& model, const Head& head) {
    const auto pass =
        std::find_if(model.passes.begin(), model.passes.end(), [&](const RunPass& v) { return v.place.head == &head; });
    const Eigen::Vector2d& mirror = pass->place.mirror;
    HeadPaths paths{&head, mirror_outline(model, mirror), 0.0, {}, {}, {}};
    if (!head.design) return paths;
    if (!reads_axes_alone(*head.design) || head.design->beams.size() > most_simd_beams) return std::nullopt;

    paths.nominal = nominal_head(*head.design, head.standoff, model.assumed(head));
    paths.moved = moved_components(model, head);
    const Eigen::VectorXd expectations = model.draws.expectations();
    const TracedHead traced = traced_at(model, head, mirror, expectations);
    const std::vector<MirrorPose> mirrors = outermost(model, *pass, expectations);
    paths.gap = traced.optics(0).fixed.self_intersection_gap();
    std::vector<bool> moves(component_names(*head.design).size(), false);
    for (const MovedComponent& part : paths.moved) moves[std::size_t(part.component)] = true;
    int channel = 0;
    for (const int beam : signal_order(*head.design)) {
        std::optional<BeamPath> path = record_path(traced, mirrors, beam);
        if (!path || !is_bright_enough(*head.design, *path)) return std::nullopt;
        path->channel = channel++;
        path->plates = plates_of(*path, moves, paths.gap);
        paths.beams.push_back(std::move(*path));
    }
    if (!is_clear(model, head, mirror, traced, paths.beams)) return std::nullopt;
    return paths;
}

}  // namespace stepdiag
