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
template <class N>
struct AxisErrors {
    Vector3Of<N> delta, theta;
    N sine;  // sin|theta| / |theta|
};

// All errors in this interval, in two cache lines: x, y, z continued to the position 0, and slopes per mm. The fourth
// components are the coefficients of `sine`, a parabola because theta is linear: of the position in delta, of its
// square in delta_slope, and the constant in theta.
struct alignas(64) AxisInterval {
    Four delta = {}, delta_slope = {}, theta = {}, theta_slope = {};
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
    STEPDIAG_INLINED AxisErrors<double> at(double position) const noexcept {
        const auto& [delta, delta_slope, theta, theta_slope] = *interval;
        return {{linear(delta[0], delta_slope[0], position), linear(delta[1], delta_slope[1], position),
                 linear(delta[2], delta_slope[2], position)},
                {linear(theta[0], theta_slope[0], position), linear(theta[1], theta_slope[1], position),
                 linear(theta[2], theta_slope[2], position)},
                linear(theta[3], linear(delta[3], delta_slope[3], position), position)};
    }
    STEPDIAG_INLINED Vector3 delta_slope() const noexcept { return read(interval->delta_slope); }
    STEPDIAG_INLINED Vector3 theta_slope() const noexcept { return read(interval->theta_slope); }

private:
    STEPDIAG_INLINED static double linear(double value, double slope, double position) noexcept {
        return value + position * slope;
    }
    STEPDIAG_INLINED static Vector3 read(const Four& v) noexcept { return {v[0], v[1], v[2]}; }
};

// Those of four positions. Reading whole rows takes less time than gathering each number.
struct FourPlaces {
    AxisPlace a, b, c, d;

    STEPDIAG_INLINED FourTruths holds(const Four& position) const noexcept {
        const Four start = {a.start[0], b.start[0], c.start[0], d.start[0]},
                   end = {a.start[1], b.start[1], c.start[1], d.start[1]};
        return (start <= position - AxisPlace::slack) & (position + AxisPlace::slack <= end);
    }
    STEPDIAG_INLINED AxisErrors<Four> at(const Four& p) const noexcept {
        const AxisInterval &i = *a.interval, &j = *b.interval, &k = *c.interval, &l = *d.interval;
        const FourRows delta = transposed({i.delta + p[0] * i.delta_slope, j.delta + p[1] * j.delta_slope,
                                           k.delta + p[2] * k.delta_slope, l.delta + p[3] * l.delta_slope}),
                       theta = transposed({i.theta + p[0] * i.theta_slope, j.theta + p[1] * j.theta_slope,
                                           k.theta + p[2] * k.theta_slope, l.theta + p[3] * l.theta_slope});
        return {{delta.a, delta.b, delta.c}, {theta.a, theta.b, theta.c}, theta.d + p * delta.d};
    }
    STEPDIAG_INLINED Vector3Of<Four> delta_slope() const noexcept {
        return read(a.interval->delta_slope, b.interval->delta_slope, c.interval->delta_slope, d.interval->delta_slope);
    }
    STEPDIAG_INLINED Vector3Of<Four> theta_slope() const noexcept {
        return read(a.interval->theta_slope, b.interval->theta_slope, c.interval->theta_slope, d.interval->theta_slope);
    }

private:
    STEPDIAG_INLINED static Vector3Of<Four> read(const Four& i, const Four& j, const Four& k, const Four& l) noexcept {
        const FourRows rows = transposed({i, j, k, l});
        return {rows.a, rows.b, rows.c};
    }
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
    STEPDIAG_INLINED AxisPlace find(double position) const noexcept { return find(position, bucket_of(position)); }
    STEPDIAG_INLINED FourPlaces find(const Four& position) const noexcept {
        using Buckets = std::int32_t __attribute__((vector_size(16)));
        const auto i = __builtin_convertvector(position * buckets_per_mm_ + bucket_of_home_, Buckets);
        return {find(position[0], std::size_t(i[0])), find(position[1], std::size_t(i[1])),
                find(position[2], std::size_t(i[2])), find(position[3], std::size_t(i[3]))};
    }

    std::size_t size() const { return intervals_.size(); }
    AxisPlace operator[](std::size_t i) const { return {&intervals_[i], &start_[i]}; }

private:
    STEPDIAG_INLINED AxisPlace find(double position, std::size_t bucket) const noexcept {
        std::size_t i = bucket;
        if (!is_regular_) {
            i = first_[bucket];
            for (std::size_t step = largest_step_; step > 0; step /= 2)
                if (position >= start_[i + step]) i += step;
        }
        return {&intervals_[i], &start_[i]};
    }
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
