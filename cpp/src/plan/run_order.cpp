#include "stepdiag/plan/run_order.hpp"

#include <algorithm>

namespace stepdiag {

Approaches approaches(const Line& line, Direction direction) {
    const int travel = direction == Direction::forward ? 1 : -1;
    Approaches approaches = all_positive;
    for (const Axis axis : all_axes)
        if (line.sign(axis) * travel < 0) approaches[index(axis)] = Approach::negative;
    return approaches;
}

std::vector<PlannedPass> planned_passes(const Plan& plan, int repeats, bool backward) {
    std::vector<Line> lines = plan.lines();
    lines.insert(lines.end(), plan.scale_lines().begin(), plan.scale_lines().end());
    std::vector<PlannedPass> passes;
    std::uint64_t row = 0;
    for (const Line& line : lines) {
        const std::size_t points = plan.points(line).size();
        for (int repeat = 0; repeat < repeats; ++repeat) {
            const std::uint64_t setup_row = row;
            const int run = backward ? 2 * repeat : repeat;
            passes.push_back({line, run, Direction::forward, row, setup_row});
            row += points;
            if (!backward) continue;
            passes.push_back({line, run + 1, Direction::backward, row, setup_row});
            row += points;
        }
    }
    return passes;
}

std::vector<PlanPoint> points_of(const Plan& plan, const PlannedPass& pass) {
    std::vector<PlanPoint> points = plan.points(pass.line, pass.run);
    if (pass.direction == Direction::backward) std::reverse(points.begin(), points.end());
    return points;
}

}  // namespace stepdiag
