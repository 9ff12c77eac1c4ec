// Errors of one axis in one table. Its nodes are the union of the nodes of the six functions and the ends of travel;
// errors are linear between them and include the squareness terms. Finding the interval of a position takes the same
// small number of steps for any distribution of nodes. The first and the last interval continue beyond the ends.
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

// All data for a position in this interval, in two cache lines.
struct alignas(64) AxisInterval {
    // Values at `start` and slopes per mm: delta x, y, z, then theta x, y, z.
    std::array<double, 6> value = {}, slope = {};
    double lower = 0.0, upper = 0.0;  // range of positions [lower, upper); -inf and +inf at the ends of the table
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

    // `edge`: travel of the axis, mm; `margin`: permitted distance of positions beyond the ends, mm. Throws
    // InvalidArgument, which names the axis, for more than largest_node_count nodes.
    AxisTable(const ErrorMap& errors, Axis axis, double edge, double margin, CompensatedApproach approach);

    // The interval of a position between -margin and edge + margin. At a boundary, rounding (1e-14 edges) may give the
    // adjacent interval, which has the same value there. Buckets of equal width limit the candidates; bisection selects
    // the interval. The bucket number is monotone: boundaries in lower buckets are below the position, those in higher
    // buckets above it.
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
    // Returns the largest number of boundaries in a bucket.
    std::size_t make_buckets(std::size_t count, double edge, double margin);

    std::size_t count_ = 0;  // number of intervals; copies of the last interval follow
    std::vector<AxisInterval> intervals_;
    std::vector<std::uint32_t> first_;  // for each bucket: the interval of its lowest positions
    double buckets_per_mm_ = 0.0, bucket_of_home_ = 0.0;
    std::size_t largest_step_ = 1;  // a power of two
    bool is_regular_ = false;       // each bucket is an interval
};

}  // namespace stepdiag
