// The order in which a run is measured: the passes along its lines, forward and backward.
#pragma once

#include <cstdint>
#include <vector>

#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

// A backward run passes a line's points in reverse order, with head and mirror as they are.
enum class Direction { forward, backward };
const char* name(Direction direction);  // as files write it

// How the axes come to each point of a pass, its first included: in the direction of the pass's own travel, because a
// measuring program overruns the start and comes back, so that backlash is taken up. An axis that the line does not
// move stands at home, approached in + direction.
Approaches approaches(const Line& line, Direction direction);

// One pass along a line.
struct PlannedPass {
    std::size_t line_index;  // among the plan's lines, then its scale lines
    Line line;
    int run;
    Direction direction;
    std::uint64_t first_row;        // of the run, where this pass begins
    std::uint64_t setup_row;        // where head and mirror were set up: the first row of the forward pass
    std::vector<PlanPoint> points;  // in the order in which they are read: descending on a backward pass
};
// The plan's lines in their order, then its scale lines; of each line runs 0, 1, 2, ..., `repeats` of them; with
// `backward` runs 0, 2, ... and after each its backward run 1, 3, ...
std::vector<PlannedPass> planned_passes(const Plan& plan, int repeats, bool backward);

}  // namespace stepdiag
