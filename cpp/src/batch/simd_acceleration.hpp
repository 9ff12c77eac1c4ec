// Anderson's acceleration (J. ACM 12 (1965) 547) of steps of many sets of readings, one in each lane. With two steps
// remembered, because a lane's steps shrink in a plane rather than along a line (simd_adjustment.hpp). Internal: not
// installed.
#pragma once

#include <array>
#include <cstddef>

#include "adjustment/bordered_band.hpp"

namespace stepdiag {

class SimdAcceleration {
public:
    SimdAcceleration(std::size_t unknowns, std::size_t residuals);

    // After a step from x by dx to the residuals s: in lanes where `ready` is 1, replaces x + dx and s by that
    // combination of them with those of the two steps before, whose dx would be the smallest. Lanes are independent of
    // each other. Numbers of lanes are stored as in simd_model.hpp.
    void apply(const double* ready, const double* x, double* dx, double* s);

    struct Past {
        AlignedNumbers dx, x, s;  // x after the step
    };

private:
    std::size_t unknowns_, residuals_;
    std::array<Past, 2> past_;  // the newest first
};

}  // namespace stepdiag
