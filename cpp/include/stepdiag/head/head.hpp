// Laser heads and their readings. The readings follow from the closed definitions of the head's layout
// (measurement/reading.hpp), or from ray tracing of a design with bodies, beams and detectors. The head is fixed in the
// machine frame, the mirror on the tool. The head's reference plane contains the beam's origin o and is normal to the
// beam. The origin o is `standoff` before the line's first commanded functional point.
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
    double aperture = 50.0;                     // edge of the square around a beam's start that receives it, mm
    std::optional<Eigen::Vector2d> mirror;  // width and height, mm; empty: as required by the plan plus mirror_margin

    static constexpr double mirror_margin = 25.0;  // on every side, mm

    // Ray-traced head: its design, the pose errors of its components, and its calibration. Set by make_head.
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

// A ray-traced head. Layout, wavelength and calibration follow from the design (nominal_head). `reading_model` replaces
// the model of all interferometers of the design. `standoff` and `mirror` (width, height) in mm. Throws InvalidArgument
// for an invalid design (check_design), a standoff within the head, or pose errors of unknown components.
Head make_head(HeadDesign design, double standoff, const std::optional<Eigen::Vector2d>& mirror = std::nullopt,
               PoseErrors pose_errors = {}, std::optional<ReadingModel> reading_model = std::nullopt);

// Default air between head and mirror. For a head with a design: air at 20 degrees Celsius, as in its calibration
// (nominal_head). For closed definitions: an index of 1, because their readings are geometric lengths.
Environment usual_environment(const Head& head);

// Throws InvalidArgument for lengths that are not positive and finite, and for collinear beams.
void check_head(const Head& head);

// Misalignment of head and mirror on one line. F is the line's frame, o the beam's origin.
struct Misalignment {
    Eigen::Vector2d reflector = Eigen::Vector2d::Zero();  // (a, b), rad: mirror normal R_tool F Exp(a, b, 0) z
    Eigen::Vector2d laser = Eigen::Vector2d::Zero();      // (a, b), rad: sensor axes F Exp(a, b, 0), rotated about o
    Eigen::Vector2d psd_zero = Eigen::Vector2d::Zero();   // layout psd: reading of a centred spot, mm
    double distance_constant = 0.0;                       // added to all distances, mm
    std::vector<double> beam_constants = {};              // layout multi_beam: added to d1 ... dn, mm; empty: all 0
    Eigen::Vector2d lateral = Eigen::Vector2d::Zero();    // shift of o along local x and y, mm
    double roll = 0.0;                                    // rad: sensor axes F Exp(laser) Exp(0, 0, roll)
    double gain = 0.0;   // factor 1 + gain on tilts (ideal), spots (psd) or beam offsets (multi_beam)
    double drift = 0.0;  // of all distances since the set-up's first reading, mm/s
};

// Pose of a head and its mirror on one line.
struct HeadSetup {
    Eigen::Vector3d origin;            // o, machine frame, mm
    Eigen::Matrix3d machine_R_sensor;  // F Exp(laser) Exp(roll)
    Eigen::Matrix3d tool_R_mirror;     // F Exp(reflector)
    Eigen::Vector2d mirror;            // width and height, mm
};

// `machine_R_line`: the line's frame F. `first_point`: the line's first commanded functional point P0, including the
// tool offset, mm. `mirror`: width and height, mm.
HeadSetup set_up(const Head& head, const Eigen::Matrix3d& machine_R_line, const Eigen::Vector3d& first_point,
                 const Eigen::Vector2d& mirror, const Misalignment& misalignment);

// Pose of the mirror in the sensor frame, for a mirror with its centre at the functional point (machine frame, mm) and
// the tool rotated by `machine_R_tool`.
MirrorPose mirror_in_sensor_frame(const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                                  const Eigen::Matrix3d& machine_R_tool);

// Names of the head's signals (channels of a Measurement), and their values for a reading in mm and rad.
std::vector<std::string> signal_names(const Head& head);
bool is_distance(const std::string& signal);
Eigen::VectorXd signals(const Head& head, const Reading& reading);

// One value for each signal (mm or rad), in the order of signal_names. A lost reading is empty.
using SignalRow = std::vector<std::optional<double>>;

// Signals of a head without a design. `mirror`: pose in the sensor frame; `size`: width and height, mm. The rules for
// lost beams are the same for all layouts. A beam has a reading if
//   - the mirror faces the head and is tilted by less than 45 degrees (read_mirror),
//   - the mirror is in front of o and of the beam's start,
//   - the beam meets the mirror's plane inside its outline,
//   - it returns to the reference plane inside the square of `aperture` around its start.
// Each beam of layout multi_beam can be lost separately. The beam of the layouts ideal and psd starts at o; if it is
// lost, all signals are lost.
SignalRow define_signals(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size);

}  // namespace stepdiag
