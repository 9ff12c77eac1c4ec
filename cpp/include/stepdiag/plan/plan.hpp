// What the machine is told to do: the lines measured through a volume, in single-axis steps.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "stepdiag/plan/line.hpp"

namespace stepdiag {

// One point of a line. Axis nodes are counted from home: node k of an axis stands at k * travel / steps.
struct PlanPoint {
    int number;                 // on its line, from 0
    Eigen::Vector3d commanded;  // mm, machine frame
    std::array<int, 3> node;    // per axis
    std::optional<Axis> moved;  // the axis that moved to get here; none for a line's first point
};

// The mirror must hold the beam wherever a step takes it: the mirror rides on the tool, the beam stays, so that the
// beam wanders over the mirror by the lateral part of the travel, in local x and y of the line, mm.
struct LateralExcursion {
    Eigen::Vector2d lowest;
    Eigen::Vector2d highest;
};

// The axes in the order in which a step moves them.
using StepOrder = std::array<Axis, 3>;

class Plan {
public:
    // A thousand steps an axis are far beyond any run; the covariance of an evaluation costs their square.
    static constexpr int largest_step_count = 2'000;

    // `volume`: edges X, Y, Z, mm. Scale lines are single-axis lines of two points. Throws InvalidArgument for an empty
    // or doubled line, a volume without extent, steps outside 1 .. largest_step_count, a scale line that moves more
    // than one axis, no order.
    Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, StepOrder order = all_axes,
         std::vector<Line> scale_lines = {});
    // Run r goes in the order r modulo their number.
    Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, std::vector<StepOrder> orders,
         std::vector<Line> scale_lines = {});

    const Eigen::Vector3d& volume() const { return volume_; }
    const std::vector<Line>& lines() const { return lines_; }
    const std::vector<Line>& scale_lines() const { return scale_lines_; }
    int steps() const { return steps_; }
    const std::vector<StepOrder>& orders() const { return orders_; }
    const StepOrder& order(int run = 0) const;

    bool contains(const Line& line) const;  // among the lines or the scale lines
    bool is_scale_line(const Line& line) const;
    double node_position(Axis axis, int node) const { return node * volume_[index(axis)] / steps_; }
    std::vector<double> nodes(Axis axis) const;
    Eigen::Matrix3d frame(const Line& line) const { return line_frame(line, volume_); }

    // The points of a line of this plan, from 0; 3N+1 on a body diagonal, 2N+1 on a face diagonal, N+1 on a single
    // axis, 2 on a scale line.
    std::vector<PlanPoint> points(const Line& line, int run = 0) const;

    LateralExcursion lateral_excursion(const Line& line) const;  // in any of the orders
    // Width (local x) and height (local y) of the smallest mirror, centred on the functional point, for all lines, mm.
    // A beam of finite diameter needs that much more.
    Eigen::Vector2d smallest_mirror() const;

private:
    Eigen::Vector3d volume_;
    std::vector<Line> lines_;
    int steps_;
    std::vector<StepOrder> orders_;
    std::vector<Line> scale_lines_;
};

StepOrder parse_order(std::string_view text);  // "XYZ", "YZX", ...: a permutation

}  // namespace stepdiag
