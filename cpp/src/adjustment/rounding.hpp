// How finely a reading is known at best: its numbers are rounded. A standard uncertainty below that means nothing.
// Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_problem.hpp"

namespace stepdiag {

// Standard uncertainty of a reading and of its model by double precision. Residuals of runs without noise have an rms
// of 0.6 times that of distances, for machines of 1 mm to 10 m (benchmarks/precision.py). `longest`: of the lengths
// that pose and reading are calculated from, mm.
double double_rounding(HeadLayout kind, int channel, double longest);

// Readings of one channel were written with so many decimals that they are all multiples of the step that this returns:
// 100, 10, ... 1e-9 units; 0 where they are finer. `unit`: of files, 1e-6 for µrad. Multiples where the plan has
// multiples, too, or all as far from the plan, tell none: a machine without errors reads round numbers.
double decimal_step(const std::vector<double>& values, const std::vector<double>& planned, double unit);

}  // namespace stepdiag
