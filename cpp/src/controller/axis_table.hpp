// Errors of one axis in one table. Its nodes are the union of the nodes of the six functions and the ends of travel;
// errors are linear between them and include the squareness terms. Finding the interval of a position takes the same
// small number of steps for any distribution of nodes, and none if they are equidistant. The first and the last
// interval continue beyond the ends.
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
    double sine;  // sin|theta| / |theta|
};

// Four numbers that are computed at once where the processor can.
using Four = double __attribute__((vector_size(32)));

// All errors in this interval, in two cache lines: x, y, z continued to the position 0, and slopes per mm. The fourth
// components of delta, its slope and theta are the coefficients of `sine`, a parabola because theta is linear.
struct alignas(64) AxisInterval {
    Four delta = {0.0, 0.0, 0.0, 1.0}, delta_slope = {}, theta = {}, theta_slope = {};

    STEPDIAG_INLINED AxisErrors at(double position) const noexcept {
        const auto linear = [&](const Four& value, const Four& slope) noexcept -> Vector3 {
            return {value[0] + position * slope[0], value[1] + position * slope[1], value[2] + position * slope[2]};
        };
        return {linear(delta, delta_slope), linear(theta, theta_slope),
                delta[3] + position * (delta_slope[3] + position * theta[3])};
    }
};
static_assert(sizeof(AxisInterval) == 128);

// A position's interval: its errors, its start and, next to that, its end. The first and last have the margin in them.
struct AxisPlace {
    const AxisInterval* interval;
    const double* start;  // mm

    static constexpr double slack = 1e-6;  // mm
    // Whether this is the interval of all positions that are nearer than `slack`.
    STEPDIAG_INLINED bool holds(double position) const noexcept {
        return start[0] <= position - slack && position + slack <= start[1];
    }
    STEPDIAG_INLINED AxisErrors at(double position) const noexcept { return interval->at(position); }
    Vector3 delta_slope() const noexcept { return read(interval->delta_slope); }
    Vector3 theta_slope() const noexcept { return read(interval->theta_slope); }

private:
    static Vector3 read(const Four& v) noexcept { return {v[0], v[1], v[2]}; }
};

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
    STEPDIAG_INLINED AxisPlace find(double position) const noexcept {
        std::size_t i = bucket_of(position);
        if (!is_regular_) {
            i = first_[i];
            for (std::size_t step = largest_step_; step > 0; step /= 2)
                if (position >= start_[i + step]) i += step;
        }
        return {&intervals_[i], &start_[i]};
    }

    std::size_t size() const { return intervals_.size(); }
    AxisPlace operator[](std::size_t i) const { return {&intervals_[i], &start_[i]}; }

private:
    STEPDIAG_INLINED std::size_t bucket_of(double position) const noexcept {
        return std::size_t(std::int64_t(position * buckets_per_mm_ + bucket_of_home_));
    }
    // Returns the largest number of boundaries in a bucket.
    std::size_t make_buckets(std::size_t count, double edge, double margin);

    std::vector<AxisInterval> intervals_;
    std::vector<double> start_;         // of each interval, end of the last one, and infinity for the bisection, mm
    std::vector<std::uint32_t> first_;  // for each bucket: the interval of its lowest positions
    double buckets_per_mm_ = 0.0, bucket_of_home_ = 0.0;
    std::size_t largest_step_ = 1;  // a power of two
    bool is_regular_ = false;       // each bucket is an interval
};

}  // namespace stepdiag
