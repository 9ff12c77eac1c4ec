#include "stepdiag/plan/plan.hpp"

#include <algorithm>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

const char* name(ScalePoints points) { return points == ScalePoints::ends ? "ends" : "steps"; }

ScalePoints parse_scale_points(std::string_view text) {
    for (const ScalePoints points : {ScalePoints::ends, ScalePoints::steps})
        if (text == name(points)) return points;
    throw InvalidArgument("scale_points: expected \"ends\" or \"steps\", got \"" + std::string(text) + "\"");
}

StepOrder parse_order(std::string_view text) {
    std::string sorted(text);
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "XYZ") throw InvalidArgument("order \"" + std::string(text) + "\": expected a permutation of XYZ");
    StepOrder order;
    for (int i = 0; i < 3; ++i) order[i] = Axis(text[i] - 'X');
    return order;
}

Plan::Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, StepOrder order,
           std::vector<Line> scale_lines, const CheckPoints& check_points, ScalePoints scale_points, int block)
    : Plan(volume, std::move(lines), steps, std::vector{order}, std::move(scale_lines), check_points, scale_points,
           block) {}

Plan::Plan(const Eigen::Vector3d& volume, std::vector<Line> lines, int steps, std::vector<StepOrder> orders,
           std::vector<Line> scale_lines, const CheckPoints& check_points, ScalePoints scale_points, int block)
    : volume_(volume),
      lines_(std::move(lines)),
      steps_(steps),
      orders_(std::move(orders)),
      scale_lines_(std::move(scale_lines)),
      check_points_(check_points),
      scale_points_(scale_points),
      block_(block) {
    if (!volume_.allFinite() || volume_.minCoeff() < 1e-3 || volume_.maxCoeff() > 1e6)
        throw InvalidArgument("volume: expected three edges in mm, each from 0.001 to 1e6");
    if (steps_ < 1 || steps_ > largest_step_count)
        throw InvalidArgument("steps: expected 1 to " + std::to_string(largest_step_count) + ", got " +
                              std::to_string(steps_));
    if (block_ < 1 || block_ > steps_)
        throw InvalidArgument("block: expected 1 to " + std::to_string(steps_) + " (steps), got " +
                              std::to_string(block_));
    if (lines_.empty() && scale_lines_.empty()) throw InvalidArgument("lines: expected at least one line");
    if (scale_lines_.empty() && scale_points_ == ScalePoints::steps)
        throw InvalidArgument("scale_points: expected scale_lines as well, got none");
    if (orders_.empty()) throw InvalidArgument("order: expected at least one permutation of XYZ");
    for (const auto& [key, value] : {std::pair("every", check_points_.every), std::pair("at", check_points_.at)})
        if (value < 0 || value > steps_)
            throw InvalidArgument(std::string("check_points ") + key + ": expected 0 to " + std::to_string(steps_) +
                                  " (steps), got " + std::to_string(value));
    std::vector<std::string> seen;
    for (const auto* group : {&lines_, &scale_lines_})
        for (const Line& line : *group) {
            if (group == &scale_lines_ && line.moved_axes() != 1)
                throw InvalidArgument("scale_lines: expected single-axis lines such as \"p00\", got \"" + line.name() +
                                      "\"");
            if (std::find(seen.begin(), seen.end(), line.name()) != seen.end())
                throw InvalidArgument("lines: \"" + line.name() +
                                      "\" is given twice (a repeated measurement is another run of the same line)");
            seen.push_back(line.name());
        }
}

bool Plan::contains(const Line& line) const {
    return is_scale_line(line) || std::find(lines_.begin(), lines_.end(), line) != lines_.end();
}

bool Plan::is_scale_line(const Line& line) const {
    return std::find(scale_lines_.begin(), scale_lines_.end(), line) != scale_lines_.end();
}

std::vector<double> Plan::nodes(Axis axis) const {
    std::vector<double> nodes(steps_ + 1);
    for (int k = 0; k <= steps_; ++k) nodes[k] = node_position(axis, k);
    return nodes;
}

const StepOrder& Plan::order(int run) const {
    const int count = int(orders_.size());
    return orders_[((run % count) + count) % count];  // a run number may be negative
}

std::vector<PlanPoint> Plan::points(const Line& line, int run) const {
    const bool scale = is_scale_line(line);
    if (!contains(line)) throw InvalidArgument("line \"" + line.name() + "\" is not in the plan");
    PlanPoint point{0, Eigen::Vector3d::Zero(), {0, 0, 0}, std::nullopt};
    const auto place = [&](Axis axis, int node) {
        point.node[index(axis)] = node;
        point.commanded[index(axis)] = node_position(axis, node);
    };
    for (const Axis axis : all_axes) place(axis, line.sign(axis) < 0 ? steps_ : 0);

    std::vector<PlanPoint> points{point};
    const bool ends = scale && scale_points_ == ScalePoints::ends;
    PlanPoint check = point;
    for (const Axis axis : all_axes)
        if (line.moves(axis)) {
            check.node[index(axis)] += line.sign(axis) * check_points_.at;
            check.commanded[index(axis)] = node_position(axis, check.node[index(axis)]);
        }
    check.is_check = true;
    for (int made = 0; made < steps_;) {
        const int before = made, ahead = ends ? steps_ : std::min(block_, steps_ - made);
        const int stride = ends ? steps_ : 1;
        for (const Axis axis : order(run))
            for (int step = 0; line.moves(axis) && step < ahead; step += stride) {
                place(axis, point.node[index(axis)] + line.sign(axis) * stride);
                point.moved = axis;
                ++point.number;
                points.push_back(point);
            }
        made += ahead;
        const int every = check_points_.every;
        if (scale || every == 0 || made / every == before / every || made <= check_points_.at) continue;
        check.number = ++point.number;
        points.push_back(check);
    }
    return points;
}

LateralExcursion Plan::lateral_excursion(const Line& line) const {
    // Every block repeats the same lateral motion, so one of them gives the full range.
    const Plan one_step(volume_, {line}, 1, orders_);
    const Eigen::Matrix<double, 3, 2> lateral = frame(line).leftCols<2>();
    LateralExcursion excursion{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
    for (int run = 0; run < int(orders_.size()); ++run) {
        const auto points = one_step.points(line, run);
        for (const PlanPoint& point : points) {
            const Eigen::Vector2d offset =
                lateral.transpose() * (point.commanded - points.front().commanded) * (double(block_) / steps_);
            excursion.lowest = excursion.lowest.cwiseMin(offset);
            excursion.highest = excursion.highest.cwiseMax(offset);
        }
    }
    return excursion;
}

Eigen::Vector2d Plan::smallest_mirror() const {
    Eigen::Vector2d size = Eigen::Vector2d::Zero();
    for (const Line& line : lines_) {
        const LateralExcursion excursion = lateral_excursion(line);
        size = size.cwiseMax(2.0 * excursion.highest).cwiseMax(-2.0 * excursion.lowest);
    }
    return size;
}

}  // namespace stepdiag
