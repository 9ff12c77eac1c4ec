// Readings of a head without a design by ray tracing (Embree). They are the truth for the closed definition of the
// readings and for the rules for lost beams. The code is independent of them: it traces a mirror, and a square that
// receives the beam.
#pragma once

#include <optional>

#include "stepdiag/head/head.hpp"
#include "stepdiag/optics/path.hpp"

namespace stepdiag::test {

// Result for one beam, in the sensor frame.
struct TracedBeam {
    double half_path;  // half of the round trip between reference plane and mirror, mm
    Eigen::Vector3d point, direction;

    // The normal bisects outgoing and returned beam: n ~ z - r. Hence beta = n_x/n_z and alpha = -n_y/n_z.
    Reading reading() const {
        return {half_path, direction.y() / (1.0 - direction.z()), -direction.x() / (1.0 - direction.z())};
    }
};

// `start`: origin of the beam in the reference plane, mm. Empty if the beam misses the mirror or does not return.
inline std::optional<TracedBeam> trace_beam(const Head& head, const HeadSetup& setup, const Eigen::Vector2d& start,
                                            const Eigen::Vector3d& functional_point,
                                            const Eigen::Matrix3d& machine_R_tool, const Medium& air = {}) {
    const Eigen::Vector3d from = setup.origin + setup.machine_R_sensor.leftCols<2>() * start;
    const Scene scene(
        {make_rectangle(functional_point, machine_R_tool * setup.tool_R_mirror, setup.mirror, Surface::reflecting),
         make_rectangle(from, setup.machine_R_sensor, Eigen::Vector2d::Constant(head.aperture), Surface::absorbing)});
    const Path path = trace(scene, air, {from, setup.machine_R_sensor.col(2)});
    if (path.end != PathEnd::absorbed || path.hits.size() != 2 || path.hits[0].face != 0 || path.hits[1].face != 1)
        return std::nullopt;
    const Eigen::Matrix3d sensor_R_machine = setup.machine_R_sensor.transpose();
    return TracedBeam{path.optical_length / (2.0 * air.index), sensor_R_machine * (path.hits[1].point - setup.origin),
                      sensor_R_machine * path.direction};
}

inline SignalRow trace_signals(const Head& head, const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                               const Eigen::Matrix3d& machine_R_tool) {
    SignalRow row;
    if (head.layout == HeadLayout::multi_beam) {
        for (const Eigen::Vector2d& start : head.beam_offsets) {
            const auto beam = trace_beam(head, setup, start, functional_point, machine_R_tool);
            row.push_back(beam ? std::optional(beam->half_path) : std::nullopt);
        }
        return row;
    }
    const auto beam = trace_beam(head, setup, Eigen::Vector2d::Zero(), functional_point, machine_R_tool);
    if (!beam) return SignalRow(3);
    if (head.layout == HeadLayout::ideal) return {beam->half_path, beam->reading().alpha, beam->reading().beta};
    const Eigen::Vector3d spot = beam->point + head.psd_distance / -beam->direction.z() * beam->direction;
    return {beam->half_path, spot.x(), spot.y()};
}

}  // namespace stepdiag::test
