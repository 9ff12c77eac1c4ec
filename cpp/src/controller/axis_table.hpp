// The errors of one axis as one table: linear between the union of the nodes of its six functions, the squareness terms
// folded in, the ends of travel nodes as well. The interval of a position is found in the same few steps anywhere,
// however the nodes are spread. Beyond the ends the first and last intervals go on.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/vector3.hpp"
#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace stepdiag {

// Two cache lines: whatever a position needs once its interval is known.
struct alignas(64) AxisInterval {
    double lower = 0.0, upper = 0.0;  // positions in [lower, upper) belong here: -inf and +inf where the table ends
    double start = 0.0;               // mm, where the values hold
    Vector3 delta = {}, delta_slope = {};  // mm, mm/mm
    Vector3 theta = {}, theta_slope = {};  // rad, rad/mm

    bool holds(double position) const noexcept { return lower <= position && position < upper; }
    STEPDIAG_INLINED Vector3 delta_at(double position) const noexcept {
        return delta + (position - start) * delta_slope;
    }
    STEPDIAG_INLINED Vector3 theta_at(double position) const noexcept {
        return theta + (position - start) * theta_slope;
    }
};
static_assert(sizeof(AxisInterval) == 128);

class AxisTable {
public:
    static constexpr std::size_t largest_node_count = 100'000;  // 13 MB

    // `edge`: travel of the axis; `margin`: how far beyond its ends positions may be, mm. Throws InvalidArgument naming
    // the axis for more nodes than a controller should hold.
    AxisTable(const ErrorMap& errors, Axis axis, double edge, double margin, CompensatedApproach approach);

    // The interval of a position between -margin and edge + margin. Buckets of equal width say between which intervals
    // it is; halving finds it. Bucketing is monotone, with all its rounding, so a boundary in a lower bucket is below
    // the position and one in a higher bucket above it.
    STEPDIAG_INLINED const AxisInterval& find(double position) const noexcept {
        const AxisInterval* interval = &intervals_[first_[bucket_of(position)]];
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
};

}  // namespace stepdiag
