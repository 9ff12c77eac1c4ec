#include "stepdiag/plan/run_order.hpp"

#include <algorithm>

namespace stepdiag {

const char* name(Direction direction) { return direction == Direction::forward ? "forward" : "backward"; }

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
    for (std::size_t index = 0; index < lines.size(); ++index)
        for (int repeat = 0; repeat < repeats; ++repeat) {
            const std::uint64_t setup_row = row;
            const int run = backward ? 2 * repeat : repeat;
            const auto add = [&](int number, Direction direction) {
                std::vector<PlanPoint> points = plan.points(lines[index], number);
                if (direction == Direction::backward) std::reverse(points.begin(), points.end());
                row += points.size();
                passes.push_back(
                    {index, lines[index], number, direction, row - points.size(), setup_row, std::move(points)});
            };
            add(run, Direction::forward);
            if (backward) add(run + 1, Direction::backward);
        }
    return passes;
}

}  // namespace stepdiag
