// The errors of one axis as one table: linear between the union of the nodes of its six functions, the squareness terms
// folded in, the ends of travel nodes as well. The interval of a position is found in the same few steps anywhere,
// however the nodes are spread. Beyond the ends the first and last intervals go on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "controller/vector3.hpp"
#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace stepdiag {

// Translation and rotation of an axis, mm and rad.
struct AxisErrors {
    Vector3 delta, theta;
};

// Two cache lines: whatever a position needs once its interval is known.
struct alignas(64) AxisInterval {
    // At `start` and by mm: delta x, y, z, then theta x, y, z.
    std::array<double, 6> value = {}, slope = {};
    double lower = 0.0, upper = 0.0;  // positions in [lower, upper) belong here: -inf and +inf where the table ends
    double start = 0.0;               // mm

    bool holds(double position) const noexcept { return lower <= position && position < upper; }

    STEPDIAG_INLINED AxisErrors at(double position) const noexcept {
        const double run = position - start;
        return {{value[0] + run * slope[0], value[1] + run * slope[1], value[2] + run * slope[2]},
                {value[3] + run * slope[3], value[4] + run * slope[4], value[5] + run * slope[5]}};
    }
    Vector3 delta_slope() const noexcept { return {slope[0], slope[1], slope[2]}; }
    Vector3 theta_slope() const noexcept { return {slope[3], slope[4], slope[5]}; }
};
static_assert(sizeof(AxisInterval) == 128);

class AxisTable {
public:
    static constexpr std::size_t largest_node_count = 100'000;  // 13 MB

    // `edge`: travel of the axis; `margin`: how far beyond its ends positions may be, mm. Throws InvalidArgument naming
    // the axis for more nodes than a controller should hold.
    AxisTable(const ErrorMap& errors, Axis axis, double edge, double margin, CompensatedApproach approach);

    // The interval of a position between -margin and edge + margin; within rounding of a boundary (1e-14 edges) perhaps
    // its neighbour, which says the same there. Buckets of equal width say between which intervals it is; halving finds
    // it. Bucketing is monotone: a boundary in a lower bucket is below the position, one in a higher bucket above it.
    STEPDIAG_INLINED const AxisInterval& find(double position) const noexcept {
        const std::size_t bucket = bucket_of(position);
        if (is_regular_) return intervals_[bucket];
        const AxisInterval* interval = &intervals_[first_[bucket]];
        for (std::size_t step = largest_step_; step > 0; step /= 2)
            if (position >= interval[step - 1].upper) interval += step;
        return *interval;
    }

    const AxisInterval* begin() const { return intervals_.data(); }
    const AxisInterval* end() const { return intervals_.data() + count_; }

private:
    STEPDIAG_INLINED std::size_t bucket_of(double position) const noexcept {
        return std::size_t(std::int64_t(position * buckets_per_mm_ + bucket_of_home_));
    }
    std::size_t make_buckets(std::size_t count, double edge, double margin);  // the most boundaries in one of them

    std::size_t count_ = 0;  // of intervals that hold positions; copies of the last follow
    std::vector<AxisInterval> intervals_;
    std::vector<std::uint32_t> first_;  // of each bucket: the interval that holds its lowest positions
    double buckets_per_mm_ = 0.0, bucket_of_home_ = 0.0;
    std::size_t largest_step_ = 1;  // a power of two
    bool is_regular_ = false;       // each bucket is an interval
};

}  // namespace stepdiag
