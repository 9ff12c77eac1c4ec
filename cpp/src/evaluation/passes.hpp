// A run in the form that linear evaluations need: passes along lines, with each reading reduced to a length and two
// tilts that are linear in the parameters. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "stepdiag/evaluation/evaluation.hpp"
#include "stepdiag/measurement/reading.hpp"

namespace stepdiag {

// Change of (length, alpha, beta) with one raw channel of a reading, by one standard uncertainty.
using ChannelEffect = Eigen::Vector3d;

struct PassPoint {
    PlanPoint plan;
    Eigen::Vector2d lateral =
        Eigen::Vector2d::Zero();  // commanded travel from the line's first point, in local x and y, mm
    double travel = 0.0;          // along the line from its first point, as commanded and as the scales expand, mm
    bool has_length = false;
    bool has_tilt = false;
    Eigen::Vector3d reading = Eigen::Vector3d::Zero();  // length less travel (mm), alpha, beta (rad)
    std::vector<ChannelEffect> effects;                 // one for each raw channel that was read

    Eigen::Vector3d variance() const;
};

struct Pass {
    Line line;
    bool is_scale_line;
    Eigen::Matrix3d frame;  // machine_R_line
    std::vector<PassPoint> points;
    int first_reading;  // index of the reading of points[0] among those of all passes
    // By number of a point on its line: its place in `points`, none for a return to a check point, which these
    // evaluations do not use.
    std::vector<std::optional<int>> place = {};

    Eigen::Vector3d direction() const { return frame.col(2); }
};

enum class LengthKind {
    distance,             // the distance itself, less travel
    lever_arm_corrected,  // beam length L less travel and lever arm times tilts; needs both tilts
};

// Throws InvalidArgument naming the row if a line or point is not in the plan, a commanded position differs from the
// plan by more than 1 um, channels do not fit the head, no mirror gives the readings, or a pass has no temperatures.
std::vector<Pass> collect_passes(const Measurement& measurement, const Plan& plan, const HeadCalibrations& heads,
                                 const ReadingUncertainty& uncertainty, LengthKind kind,
                                 const std::optional<KnownExpansion>& expansion);

// A step of one axis over one of its intervals, as measured in one pass. Scale lines have no steps.
struct Step {
    int pass;
    int point;    // from `point` to `point + 1`
    double sign;  // of travel: increments times sign count in the direction of the axis
};
using AxisSteps = std::vector<std::vector<Step>>;  // for each interval, counted from home
std::array<AxisSteps, 3> collect_steps(const std::vector<Pass>& passes, const Plan& plan);

}  // namespace stepdiag
