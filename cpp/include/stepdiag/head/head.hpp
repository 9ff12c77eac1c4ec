// Laser heads: what stands before the mirror and what it reads. A head reads by the closed definition of its layout's
// readings (measurement/reading.hpp), or is made of bodies, beams and detectors (a design) and ray-traced. The head is
// fixed in the machine frame, the mirror on the tool. Its reference plane holds the beam's origin o and is normal to
// the beam; o lies `standoff` before the line's first commanded functional point.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/core/air.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/head/head_layout.hpp"
#include "stepdiag/head/traced_head.hpp"
#include "stepdiag/measurement/head_calibration.hpp"
#include "stepdiag/measurement/reading.hpp"

namespace stepdiag {

struct Head {
    HeadLayout layout = HeadLayout::ideal;
    double standoff = 100.0;                    // mm
    double psd_distance = 0.0;                  // layout psd, mm
    std::vector<Eigen::Vector2d> beam_offsets;  // layout multi_beam, mm
    double wavelength = 1530.0;                 // vacuum, nm
    double aperture = 50.0;                     // mm: edge of the square around a beam's start that takes it back
    std::optional<Eigen::Vector2d> mirror;  // width and height, mm; none: as large as the plan needs, and mirror_margin

    static constexpr double mirror_margin = 25.0;  // on every side, mm

    // A head of bodies and beams, its components out of place, and what it is calibrated with. Made by make_head.
    std::shared_ptr<const HeadDesign> design = {};
    PoseErrors pose_errors = {};
    HeadCalibration nominal = {};

    HeadCalibration calibration() const {
        HeadCalibration calibration = nominal;
        if (!design) {
            if (layout == HeadLayout::psd) calibration.psd_distance = psd_distance;
            calibration.beam_offsets = beam_offsets;
        }
        calibration.standoff = standoff;
        return calibration;
    }
};

// A traced head; its layout, wavelength and calibration come from the design (nominal_head). `reading_model`: of all
// its interferometers, instead of the design's. Throws InvalidArgument for a design that makes no sense (check_design),
// a standoff within the head, pose errors of components that it does not have.
Head make_head(HeadDesign design, double standoff, const std::optional<Eigen::Vector2d>& mirror = std::nullopt,
               PoseErrors pose_errors = {}, std::optional<ReadingModel> reading_model = std::nullopt);

// The air before a head where nobody says which: that of 20 degrees Celsius, with which a design is calibrated
// (nominal_head); an index of 1 for the closed definitions, whose readings are lengths with the index taken off.
Environment usual_environment(const Head& head);

// Throws InvalidArgument for lengths that are not positive or finite, and for beams on one line.
void check_head(const Head& head);

// How head and mirror are out of true on one line.
struct Misalignment {
    Eigen::Vector2d reflector = Eigen::Vector2d::Zero();  // (a, b): mirror normal R_tool F Exp(a, b, 0) z, rad
    Eigen::Vector2d laser = Eigen::Vector2d::Zero();      // (a, b): sensor axes F Exp(a, b, 0), turned about o, rad
    Eigen::Vector2d psd_zero = Eigen::Vector2d::Zero();   // layout psd: what a centred spot reads, mm
    double distance_constant = 0.0;                       // of all distances, mm
    std::vector<double> beam_constants = {};              // layout multi_beam: of d1 ... dn each, mm; empty: none
    Eigen::Vector2d lateral = Eigen::Vector2d::Zero();    // moves o along local x and y, mm
    double roll = 0.0;                                    // rad: sensor axes F Exp(laser) Exp(0, 0, roll)
    double gain = 0.0;   // tilts read 1 + gain times themselves; psd: spots; multi_beam: beams stand there
    double drift = 0.0;  // mm/s: of all distances since the set-up's first reading
};

// A head and its mirror set up on one line.
struct HeadSetup {
    Eigen::Vector3d origin;            // o, machine frame, mm
    Eigen::Matrix3d machine_R_sensor;  // F Exp(laser) Exp(roll)
    Eigen::Matrix3d tool_R_mirror;     // F Exp(reflector)
    Eigen::Vector2d mirror;            // width and height, mm
};

// `machine_R_line`: the line's frame F; `first_point`: its first commanded functional point P0 (tool offset included),
// mm.
HeadSetup set_up(const Head& head, const Eigen::Matrix3d& machine_R_line, const Eigen::Vector3d& first_point,
                 const Eigen::Vector2d& mirror, const Misalignment& misalignment);

// The mirror in the sensor frame, its centre at the functional point, the tool turned by `machine_R_tool`.
MirrorPose mirror_in_sensor_frame(const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                                  const Eigen::Matrix3d& machine_R_tool);

// Names of the signals a head gives (channels of a Measurement), and their values for a reading.
std::vector<std::string> signal_names(const Head& head);
bool is_distance(const std::string& signal);
Eigen::VectorXd signals(const Head& head, const Reading& reading);

// One value a signal, in the order of signal_names; lost ones are empty.
using SignalRow = std::vector<std::optional<double>>;

// What a head without a design reads of a mirror of this size. All layouts lose beams, and with them their signals, by
// the same rules. A beam is read where
//   - the mirror faces the head, tilted by less than 45 degrees (read_mirror),
//   - the mirror lies ahead of o, and of the beam's start,
//   - the beam meets the mirror's plane within its outline,
//   - it comes back to the reference plane within the square of `aperture` around its start.
// Beams of multi_beam are lost one by one; the one beam of ideal and psd starts at o.
SignalRow define_signals(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size);

}  // namespace stepdiag
