// The adjustment's model of a point's channels as one function of everything, by the text of the physics: in dual
// numbers it gives the derivatives that the model's own are tested against.
#pragma once

#include <vector>

#include "adjustment/channel_model.hpp"
#include "machine/pose-inl.hpp"
#include "measurement/reading-inl.hpp"

namespace stepdiag {

// What does not depend on unknowns.
struct KnownPoint {
    Chain chain;
    Eigen::Vector3d tool;
    ChannelModel model;  // of which the kind, the head and where the line is
    ReadingPlace place;
};

// `parameters`: 18 errors of the axes, axis by axis, then the set-up.
template <class N>
std::vector<N> read_channels(const KnownPoint& point, const std::vector<N>& parameters) {
    using namespace STEPDIAG_NAMESPACE;
    const auto constant = [](double value) { return broadcast(Type<N>(), value); };
    const N zero = constant(0.0), one = constant(1.0);
    const auto setup = [&](int column) { return parameters[18 + std::size_t(column)]; };
    const auto pair = [&](int column) { return Vector3<N>{setup(column), setup(column + 1), zero}; };
    const auto motion = [&](int rank) -> AxisMotion<N> {
        const Axis axis = point.chain.order()[rank];
        const N* const e = parameters.data() + 6 * index(axis);
        const Eigen::Vector3d nominal = point.place.commanded[index(axis)] * Eigen::Vector3d::Unit(index(axis));
        return {rotation_exp(Vector3<N>{e[3], e[4], e[5]}), broadcast3<N>(nominal) + Vector3<N>{e[0], e[1], e[2]},
                point.chain.carries_workpiece(axis)};
    };
    const ChainPose<N> pose = chain_pose({motion(0), motion(1), motion(2)}, broadcast3<N>(point.tool));
    const Placed<N> placed = place_setup(
        broadcast9<N>(point.model.machine_R_line()), broadcast3<N>(point.model.origin()),
        {pair(setup::reflector), pair(setup::laser), {zero, zero, setup(setup::roll)}, pair(setup::lateral)});
    const Vector3<N> q = transposed_product(placed.machine_R_sensor, pose.position - placed.origin);
    const Vector3<N> normal = pose.rotation * transpose(placed.tool_R_mirror).row2;
    const Vector3<N> m = transposed_product(placed.machine_R_sensor, normal);
    const MirrorReading<N> mirror = read_plane(q, m, one / m.z);
    const N scale = one + setup(setup::gain);
    const N added = distance_added(setup(setup::distance_constant), setup(setup::drift), constant(point.place.time),
                                   negative(setup(setup::cosine)), constant(point.place.travel));
    const HeadCalibration& head = point.model.head();
    const auto distance = [&](const Eigen::Vector2d& offset) {
        return beam_distance(mirror, scale * beam_arm(mirror, constant(offset.x()), constant(offset.y()))) + added;
    };
    if (point.model.kind() == ChannelKind::multi_beam) {
        std::vector<N> distances;
        for (const Eigen::Vector2d& offset : head.beam_offsets) {
            const int before = int(distances.size()) - 1;
            distances.push_back(before < 0 ? distance(offset)
                                           : distance(offset) + setup(setup::beam_constants + before));
        }
        return distances;
    }
    if (point.model.kind() == ChannelKind::ideal)
        return {distance(Eigen::Vector2d::Zero()), scale * mirror.alpha, scale * mirror.beta};
    const N arm = beam_arm(mirror, constant(head.spot_beam.x()), constant(head.spot_beam.y()));
    const auto spot = spot_reading(mirror, scale * spot_lever(mirror, arm, constant(*head.psd_distance)),
                                   setup(setup::psd_zero), setup(setup::psd_zero + 1));
    return {distance(Eigen::Vector2d::Zero()), spot.x, spot.y};
}

// Their derivatives by parameter `j`.
inline Eigen::VectorXd derivative(const KnownPoint& point, const Eigen::VectorXd& parameters, Eigen::Index j) {
    std::vector<Dual> numbers;
    for (const double value : parameters) numbers.push_back({value});
    numbers[std::size_t(j)].slope = 1.0;
    const std::vector<Dual> channels = read_channels(point, numbers);
    Eigen::VectorXd slopes(channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) slopes[Eigen::Index(c)] = channels[c].slope;
    return slopes;
}

}  // namespace stepdiag
