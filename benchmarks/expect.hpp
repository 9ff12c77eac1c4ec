// Check of results in benchmarks. A wrong result aborts the program.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>

inline void expect_near(double found, double expected, double tolerance, const char* what) {
    if (std::abs(found - expected) <= tolerance) return;
    std::fprintf(stderr, "wrong answer: %s: expected %.17g within %.1e, got %.17g\n", what, expected, tolerance, found);
    std::abort();
}
