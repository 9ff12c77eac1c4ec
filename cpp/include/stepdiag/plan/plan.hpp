// Measurement plan: the lines through the measured volume, and the single-axis steps along them. Lengths in mm, machine
// frame with its origin at home, the corner of the volume where all axis positions are 0.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "stepdiag/plan/line.hpp"

namespace stepdiag {

// One point of a line. Nodes of an axis are numbered from home: node k is at k * travel / steps.
struct PlanPoint {
    int number;                 // on its line, from 0
    Eigen::Vector3d commanded;  // mm, machine frame
    std::array<int, 3> node;    // per axis
    std::optional<Axis> moved;  // the axis that moved from the previous point; empty for the first point
    bool is_check = false;      // a return to a check point; no axis counts as moved there
};

// Returns to one point of each line, which tell a drift from the machine's errors: after every so many steps, a step
// being one move of each axis. Scale lines have none.
struct CheckPoints {
    int every = 0;  // 0: there are none
    int at = 0;     // the point is that after so many steps; 0: the line's first
};

// Range of the beam's position on the mirror, in local x and y of the line, mm. The mirror moves with the tool and the
// beam is fixed, so the beam moves over the mirror by the lateral part of the travel. The mirror must be at least this
// large.
struct LateralExcursion {
    Eigen::Vector2d lowest;
    Eigen::Vector2d highest;
};

// Where scale lines are read: at their two ends, or after every step as other single-axis lines are.
enum class ScalePoints { ends, steps };
const char* name(ScalePoints points);                   // "ends", "steps"
ScalePoints parse_scale_points(std::string_view text);  // throws InvalidArgument for any other text

// The axes in the order in which a step moves them.
using StepOrder = std::array<Axis, 3>;

class Plan {
public:
    // Limits the cost of an evaluation's covariance, which grows with the square of the steps. A thousand steps per
    // axis already exceed any practical run.
    static constexpr int largest_step_count = 2'000;

    // `volume`: edges X, Y, Z, mm. Scale lines are single-axis lines whose laser stands along the axis. Throws
    // InvalidArgument if there is no line, a line is given twice, an edge is outside 0.001 to 1e6 mm, `steps` is
    // outside 1 to largest_step_count, a scale line moves more than one axis, there is no order, check points are
    // outside 0 to `steps`, `block` is outside 1 to `steps`, or the points of scale lines are stated without any.
    Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, StepOrder order = all_axes,
         std::vector<Line> scale_lines = {}, const CheckPoints& check_points = {},
         ScalePoints scale_points = ScalePoints::ends, int block = 1);
    // Run r uses orders[r modulo the number of orders].
    Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, std::vector<StepOrder> orders,
         std::vector<Line> scale_lines = {}, const CheckPoints& check_points = {},
         ScalePoints scale_points = ScalePoints::ends, int block = 1);

    const Eigen::Vector3d& volume() const { return volume_; }
    const std::vector<Line>& lines() const { return lines_; }
    const std::vector<Line>& scale_lines() const { return scale_lines_; }
    ScalePoints scale_points() const { return scale_points_; }
    // So many steps of an axis follow each other before the next axis moves; 1: the axes take turns at every step.
    int block() const { return block_; }
    int steps() const { return steps_; }
    const std::vector<StepOrder>& orders() const { return orders_; }
    const StepOrder& order(int run = 0) const;
    const CheckPoints& check_points() const { return check_points_; }

    bool contains(const Line& line) const;  // among the lines or the scale lines
    bool is_scale_line(const Line& line) const;
    double node_position(Axis axis, int node) const { return node * volume_[index(axis)] / steps_; }
    std::vector<double> nodes(Axis axis) const;
    Eigen::Matrix3d frame(const Line& line) const { return line_frame(line, volume_); }

    // The points of a line in the order of travel. For N steps: 3N+1 on a body diagonal, 2N+1 on a face diagonal, N+1
    // on a single-axis line, 2 on a scale line that is read at its ends; and the returns to the check point where they
    // are made, which have numbers of their own. Throws InvalidArgument for a line that is not in the plan.
    std::vector<PlanPoint> points(const Line& line, int run = 0) const;

    LateralExcursion lateral_excursion(const Line& line) const;  // over all orders
    // Width (local x) and height (local y) of the smallest mirror for all lines, mm, centred on the functional point.
    // Add the diameter of the beam.
    Eigen::Vector2d smallest_mirror() const;

private:
    Eigen::Vector3d volume_;
    std::vector<Line> lines_;
    int steps_;
    std::vector<StepOrder> orders_;
    std::vector<Line> scale_lines_;
    CheckPoints check_points_;
    ScalePoints scale_points_;
    int block_;
};

// Accepts a permutation of "XYZ"; throws InvalidArgument for any other text.
StepOrder parse_order(std::string_view text);

}  // namespace stepdiag
