// The order in which the passes of a measurement are made, forward and backward along each line.
#pragma once

#include <cstdint>
#include <vector>

#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

// A backward run visits the points of a line in reverse order. Head and mirror stay as they are.
enum class Direction { forward, backward };
const char* name(Direction direction);  // as in files

// Direction from which each axis approaches the points of a pass, including the first point. It is the direction of
// travel of the pass, because a measuring program overruns the start and returns to take up backlash. An axis that the
// line does not move is at home, approached in + direction.
Approaches approaches(const Line& line, Direction direction);

// One pass along a line.
struct PlannedPass {
    std::size_t line_index;  // in the plan's lines followed by its scale lines
    Line line;
    int run;
    Direction direction;
    std::uint64_t first_row;  // number of the first row of this pass in the measurement
    std::uint64_t setup_row;  // number of the row where head and mirror were set up: first row of the forward pass
    std::vector<PlanPoint> points;  // in the order of reading, which is reversed for a backward pass
};
// The passes of all lines in the order of the plan, then those of the scale lines. Each line has the runs 0, 1, ...,
// repeats - 1. With `backward` the forward runs are 0, 2, ..., and each is followed by its backward run 1, 3, ...
std::vector<PlannedPass> planned_passes(const Plan& plan, int repeats, bool backward);

}  // namespace stepdiag
