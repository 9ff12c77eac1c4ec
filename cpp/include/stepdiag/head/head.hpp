// Laser heads: what stands before the mirror and what it reads.
//   ideal       one interferometer beam that also senses the mirror's two tilts; ray-traced
//   psd         layout b: interferometer and position sensing device (by the closed definition of its readings)
//   multi_beam  layout a: three or more parallel interferometer beams (by the closed definition of their readings)
// The head is fixed in the machine frame, the mirror on the tool. Its reference plane holds the beam's origin o and is
// normal to the beam; o lies `standoff` before the line's first commanded functional point.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/head/head_layout.hpp"
#include "stepdiag/measurement/head_calibration.hpp"
#include "stepdiag/measurement/reading.hpp"
#include "stepdiag/optics/medium.hpp"

namespace stepdiag {

struct Head {
    HeadLayout layout = HeadLayout::ideal;
    double standoff = 100.0;                    // mm
    double psd_distance = 0.0;                  // layout psd, mm
    std::vector<Eigen::Vector2d> beam_offsets;  // layout multi_beam, mm
    double wavelength = 1530.0;                 // vacuum, nm
    double aperture = 50.0;                 // edge of the square in the reference plane that takes the beam back, mm
    std::optional<Eigen::Vector2d> mirror;  // width and height, mm; none: as large as the plan needs, and mirror_margin

    static constexpr double mirror_margin = 25.0;  // on every side, mm

    HeadCalibration calibration() const {
    return {layout == HeadLayout::psd ? std::optional(psd_distance) : std::nullopt, beam_offsets};
    }
};

// Throws InvalidArgument for lengths that are not positive or finite, and for beams on one line.
void check_head(const Head& head);

// How head and mirror are out of true on one line.
struct Misalignment {
    Eigen::Vector2d reflector = Eigen::Vector2d::Zero();  // (a, b): mirror normal R_tool F Exp(a, b, 0) z, rad
    Eigen::Vector2d laser = Eigen::Vector2d::Zero();      // (a, b): sensor axes F Exp(a, b, 0), turned about o, rad
    Eigen::Vector2d psd_zero = Eigen::Vector2d::Zero();   // layout psd: what a centred spot reads, mm
};

// A head and its mirror set up on one line.
struct HeadSetup {
    Eigen::Vector3d origin;            // o, machine frame, mm
    Eigen::Matrix3d machine_R_sensor;  // F Exp(laser)
    Eigen::Matrix3d tool_R_mirror;     // F Exp(reflector)
    Eigen::Vector2d mirror;            // width and height, mm
    Eigen::Vector2d psd_zero;          // mm
};

// `machine_R_line`: the line's frame F; `first_point`: its first commanded functional point P0 (tool offset included),
// mm.
HeadSetup set_up(const Head& head, const Eigen::Matrix3d& machine_R_line, const Eigen::Vector3d& first_point,
                 const Eigen::Vector2d& mirror, const Misalignment& misalignment);

// The mirror's reading with its centre at the functional point and the tool turned by `machine_R_tool`:
// by ray tracing (none where the beam misses the mirror or does not come back to the head), or by the closed
// definition.
std::optional<Reading> trace_reading(const Head& head, const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                                     const Eigen::Matrix3d& machine_R_tool, const Medium& ambient);
std::optional<Reading> define_reading(const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                                      const Eigen::Matrix3d& machine_R_tool);

// Names of the signals a head gives (channels of a Measurement), and their values for a reading.
std::vector<std::string> signal_names(const Head& head);
Eigen::VectorXd signals(const Head& head, const HeadSetup& setup, const Reading& reading);

}  // namespace stepdiag
