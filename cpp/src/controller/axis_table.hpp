// The errors of one axis as one table: linear between the union of the nodes of its six functions, the squareness terms
// folded in, the ends of travel nodes as well. The interval of a position is found in the same few steps anywhere,
// however the nodes are spread. Beyond the ends the first and last intervals go on.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace stepdiag {

// Two cache lines: whatever a position needs once its interval is known.
struct alignas(64) AxisInterval {
    double lower = 0.0, upper = 0.0;  // positions in [lower, upper) belong here: -inf and +inf where the table ends
    double start = 0.0;               // mm, where the values hold
    std::array<double, 3> delta = {}, delta_slope = {};  // mm, mm/mm
    std::array<double, 3> theta = {}, theta_slope = {};  // rad, rad/mm

    bool holds(double position) const noexcept { return lower <= position && position < upper; }
    Eigen::Vector3d delta_at(double position) const noexcept { return at(delta, delta_slope, position); }
    Eigen::Vector3d theta_at(double position) const noexcept { return at(theta, theta_slope, position); }

private:
    Eigen::Vector3d at(const std::array<double, 3>& value, const std::array<double, 3>& slope,
                       double position) const noexcept {
        const double run = position - start;
        return {value[0] + run * slope[0], value[1] + run * slope[1], value[2] + run * slope[2]};
    }
};
static_assert(sizeof(AxisInterval) == 128);

class AxisTable {
public:
    static constexpr std::size_t largest_node_count = 100'000;  // 13 MB

    // `edge`: travel of the axis, mm. Throws InvalidArgument naming the axis for more nodes than a controller should
    // hold.
    AxisTable(const ErrorMap& errors, Axis axis, double edge, CompensatedApproach approach);

    // Buckets of equal width say between which intervals a position is; halving finds it. Bucketing is monotone, with
    // all its rounding, so a boundary in a lower bucket is below the position and one in a higher bucket above it.
    const AxisInterval& find(double position) const noexcept {
        const std::int32_t bucket = bucket_of(position);
        const AxisInterval* interval = &intervals_[first_[std::size_t(bucket)]];
        for (std::uint32_t step = largest_step_; step > 0; step /= 2)
            if (position >= interval[step - 1].upper) interval += step;
        return *interval;
    }

    const AxisInterval* begin() const { return intervals_.data(); }
    const AxisInterval* end() const { return intervals_.data() + count_; }

private:
    std::int32_t bucket_of(double position) const noexcept {
        const auto bucket = std::int32_t(position * buckets_per_mm_);  // positions are those of a machine: no overflow
        return bucket < 0 ? 0 : bucket > last_bucket_ ? last_bucket_ : bucket;
    }
    std::uint32_t make_buckets(std::size_t count, double edge);  // the most boundaries in one of them

    std::size_t count_ = 0;  // of intervals that hold positions; copies of the last follow
    std::vector<AxisInterval> intervals_;
    std::vector<std::uint32_t> first_;  // of each bucket: the interval that holds its lowest positions
    double buckets_per_mm_ = 0.0;
    std::int32_t last_bucket_ = 0;
    std::uint32_t largest_step_ = 1;  // a power of two
};

}  // namespace stepdiag
