// A machine, and a plan of two diagonals and a scale line.
#pragma once

#include "stepdiag/machine/machine.hpp"
#include "support/usual.hpp"

namespace stepdiag::test::two_diagonals {

inline Machine machine() {
    RandomErrorMap options;
    options.seed = 4;
    return Machine(chain, make_random_error_map(volume, options), {5.0, -3.0, 70.0});
}

inline Plan plan(int steps = 10) {
    return Plan(volume, {Line::parse("ppp"), Line::parse("nnp")}, steps, all_axes, {Line::parse("p00")});
}

}  // namespace stepdiag::test::two_diagonals
