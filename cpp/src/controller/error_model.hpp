// Exact error of the machine (machine.hpp) from prepared tables. The calculation goes from the tool to the workpiece.
// Each axis moves a point with nominal position n (the lever of the axis) and actual position n + d:
//   after the bed    d <- d + (Exp theta - I)(n + d) + delta(p)
//   before the bed   d <- d + delta(p),   then   d <- d + (Exp theta - I)(n + d)
// The last d is the error. The calculation does not subtract large numbers.
#pragma once

#include <array>

#include "controller/axis_table.hpp"
#include "controller/vector3.hpp"
#include "stepdiag/machine/chain.hpp"

namespace stepdiag {

// Largest rotation of one axis, rad. Machine tools have a tenth of it.
inline constexpr double largest_angle = 2e-3;

// d + (Exp theta - I) v, where
//   (Exp theta - I) v = sin|theta|/|theta| theta x (v + tan(|theta|/2)/|theta| theta x v)
// Both factors are truncated series. The error is at most |theta|^5 |v| / 120: 3e-16 |v| at the largest angle, 1e-12 mm
// at 4 m.
// `sine` is the first factor; the second, 1/2 + |theta|^2 / 24, is 3/4 - sine / 4.
template <class N>
STEPDIAG_INLINED Vector3Of<N> add_turn(const Vector3Of<N>& d, const Vector3Of<N>& theta, const N& sine,
                                       const Vector3Of<N>& v) noexcept {
    return add_cross(d, sine * theta, add_cross(v, (0.75 - 0.25 * sine) * theta, v));
}

template <class N>
struct Quaternion {
    N w;
    Vector3Of<N> v;
};
template <class N>
STEPDIAG_INLINED Quaternion<N> operator*(const Quaternion<N>& a, const Quaternion<N>& b) noexcept {
    return {a.w * b.w - dot(a.v, b.v), a.w * b.v + b.w * a.v + cross(a.v, b.v)};
}
// Exp theta. The truncation error of its series is below 1e-17 at the largest angle.
template <class N>
STEPDIAG_INLINED Quaternion<N> rotation(const Vector3Of<N>& theta) noexcept {
    const N angle2 = dot(theta, theta);
    return {1.0 - angle2 * (1.0 / 8.0), (0.5 - angle2 * (1.0 / 48.0)) * theta};
}
// 2 asin(s)/s v with s = |v|. If three axes rotate by the largest angle, the next term is 2e-11 of it, or 1e-13 rad.
template <class N>
STEPDIAG_INLINED Vector3Of<N> rotation_vector(const Quaternion<N>& q) noexcept {
    return (2.0 + dot(q.v, q.v) * (1.0 / 3.0)) * q.v;
}

// What the scales add to delta(p) along each axis: nothing without their temperatures,
struct ScalesOfTable {
    template <int axis, class N>
    STEPDIAG_INLINED Vector3Of<N> expanded(const Vector3Of<N>& delta, const N& /*position*/) const noexcept {
        return delta;
    }
    template <int axis, class N>
    STEPDIAG_INLINED Vector3Of<N> expanded_slope(const Vector3Of<N>& delta_slope) const noexcept {
        return delta_slope;
    }
};
// and rate (p - fixed_point) with them (machine/expansion.hpp).
struct ExpandedScales {
    Vector3 rate, fixed_point;  // coefficient times temperature minus reference; mm

    template <int axis, class N>
    STEPDIAG_INLINED Vector3Of<N> expanded(const Vector3Of<N>& of_table, const N& position) const noexcept {
        Vector3Of<N> delta = of_table;
        of_axis<axis>(delta) += of_axis<axis>(rate) * (position - of_axis<axis>(fixed_point));
        return delta;
    }
    template <int axis, class N>
    STEPDIAG_INLINED Vector3Of<N> expanded_slope(const Vector3Of<N>& of_table) const noexcept {
        Vector3Of<N> delta_slope = of_table;
        of_axis<axis>(delta_slope) += of_axis<axis>(rate);
        return delta_slope;
    }
};

// Axes from workpiece to tool, X, Y, Z = 0, 1, 2. As a compile-time constant it avoids looking up components.
template <int first, int second, int third>
struct AxisOrder {};

class ErrorModel {
public:
    // Valid for positions up to `margin` (mm) outside the volume.
    ErrorModel(const Chain& chain, const ErrorMap& errors, const std::array<double, 3>& volume, double margin,
               CompensatedApproach approach);

    // The intervals of the three axes for a position (Place is AxisPlace), or for four (FourPlaces).
    template <class Place>
    struct CellOf {
        Place x, y, z;

        STEPDIAG_INLINED bool holds(const Vector3& p) const noexcept {
            return x.holds(p.x) && y.holds(p.y) && z.holds(p.z);
        }
        STEPDIAG_INLINED FourTruths holds(const Vector3Of<Four>& p) const noexcept {
            return x.holds(p.x) & y.holds(p.y) & z.holds(p.z);
        }
    };
    using Cell = CellOf<AxisPlace>;
    STEPDIAG_INLINED Cell cell(const Vector3& p) const noexcept {
        return {tables_[0].find(p.x), tables_[1].find(p.y), tables_[2].find(p.z)};
    }
    STEPDIAG_INLINED CellOf<FourPlaces> cell(const Vector3Of<Four>& p) const noexcept {
        return {tables_[0].find(p.x), tables_[1].find(p.y), tables_[2].find(p.z)};
    }

    template <int first, int second, int third, class Scales, class N, class Cell>
    STEPDIAG_INLINED Vector3Of<N> error(AxisOrder<first, second, third>, const Scales& scales, const Vector3Of<N>& p,
                                        const Vector3& tool, const Cell& cell) const noexcept {
        Vector3Of<N> lever = broadcast<N>(tool), d = start<third>(scales, p, cell, lever);
        move<second>(1, scales, p, cell, lever, d);
        move<first>(0, scales, p, cell, lever, d);
        return d;
    }

    // Error to second order in the errors, and its derivative with respect to the position to first order. Column a is
    //   delta_a' + theta_a' x lever_a + (sum of the thetas that rotate the direction of a) x e_a
    template <class N>
    struct Estimate {
        Vector3Of<N> error;
        Matrix3Of<N> slope;
    };
    template <int first, int second, int third, class Scales, class N, class Cell>
    STEPDIAG_INLINED Estimate<N> estimate(AxisOrder<first, second, third>, const Scales& scales, const Vector3Of<N>& p,
                                          const Vector3& tool, const Cell& cell) const noexcept {
        Matrix3Of<N> slope;
        const Vector3Of<N> theta1 = of_axis<first>(cell).at(of_axis<first>(p)).theta;
        const Vector3Of<N> theta2 = theta1 + of_axis<second>(cell).at(of_axis<second>(p)).theta;
        of_axis<first>(slope) = carries_workpiece(0) ? cross_unit<first>(theta1) : Vector3Of<N>{};
        of_axis<second>(slope) = cross_unit<second>(carries_workpiece(1) ? theta2 : theta1);
        of_axis<third>(slope) = cross_unit<third>(
            carries_workpiece(2) ? theta2 + of_axis<third>(cell).at(of_axis<third>(p)).theta : theta2);
        Vector3Of<N> lever = broadcast<N>(tool), error1 = {}, error2 = {};
        estimate<third>(2, scales, p, cell, lever, error1, error2, slope);
        estimate<second>(1, scales, p, cell, lever, error1, error2, slope);
        estimate<first>(0, scales, p, cell, lever, error1, error2, slope);
        return {error1 + error2, slope};
    }

    // Rotation vector of the tool, from the product of the axes' rotations, rad.
    template <int first, int second, int third, class N, class Cell>
    STEPDIAG_INLINED Vector3Of<N> orientation(AxisOrder<first, second, third>, const Vector3Of<N>& p,
                                              const Cell& cell) const noexcept {
        return rotation_vector(rotation(of_axis<first>(cell).at(of_axis<first>(p)).theta) *
                               rotation(of_axis<second>(cell).at(of_axis<second>(p)).theta) *
                               rotation(of_axis<third>(cell).at(of_axis<third>(p)).theta));
    }

    // Bounds for all valid positions and all tools up to the length `largest_tool`, mm, with scales as in the table and
    // with rates of their expansion up to those of `scales`; see error_model.cpp.
    struct Bounds {
        double error;        // |e| <= error, mm
        double contraction;  // |e(p) - e(q)| <= contraction |p - q|, and |slope| <= contraction
        double bend;         // |de/dp - slope| <= bend within a cell, for positions up to 3 |e| from that of the slope
    };
    Bounds bounds(double largest_tool, const ExpandedScales& scales) const;

private:
    bool carries_workpiece(int rank) const noexcept { return rank < axes_before_bed_; }

    // Effect of the axis next to the tool, where d is initially 0.
    template <int axis, class Scales, class N, class Cell>
    STEPDIAG_INLINED Vector3Of<N> start(const Scales& scales, const Vector3Of<N>& p, const Cell& cell,
                                        Vector3Of<N>& lever) const noexcept {
        const auto& place = of_axis<axis>(cell);
        const N position = of_axis<axis>(p);
        const auto [of_table, theta, sine] = place.at(position);
        const Vector3Of<N> delta = scales.template expanded<axis>(of_table, position);
        if (carries_workpiece(2)) {
            of_axis<axis>(lever) += position;
            return add_turn(delta, theta, sine, lever + delta);
        }
        const Vector3Of<N> d = add_turn(delta, theta, sine, lever);
        of_axis<axis>(lever) += position;
        return d;
    }
    template <int axis, class Scales, class N, class Cell>
    STEPDIAG_INLINED void move(int rank, const Scales& scales, const Vector3Of<N>& p, const Cell& cell,
                               Vector3Of<N>& lever, Vector3Of<N>& d) const noexcept {
        const auto& place = of_axis<axis>(cell);
        const N position = of_axis<axis>(p);
        const auto [of_table, theta, sine] = place.at(position);
        const Vector3Of<N> delta = scales.template expanded<axis>(of_table, position);
        if (carries_workpiece(rank)) {
            of_axis<axis>(lever) += position;
            d = d + delta;
            d = add_turn(d, theta, sine, lever + d);
        } else {
            d = add_turn(d + delta, theta, sine, lever + d);
            of_axis<axis>(lever) += position;
        }
    }

    // Adds one axis to the terms of first and of second order, and to its column of the slope.
    template <int axis, class Scales, class N, class Cell>
    STEPDIAG_INLINED void estimate(int rank, const Scales& scales, const Vector3Of<N>& p, const Cell& cell,
                                   Vector3Of<N>& lever, Vector3Of<N>& error1, Vector3Of<N>& error2,
                                   Matrix3Of<N>& slope) const noexcept {
        const auto& place = of_axis<axis>(cell);
        const N position = of_axis<axis>(p);
        const auto [of_table, theta, sine] = place.at(position);
        const Vector3Of<N> delta = scales.template expanded<axis>(of_table, position);
        if (carries_workpiece(rank)) of_axis<axis>(lever) += position;
        const Vector3Of<N> turned = cross(theta, lever), moved = error1 + delta;
        error2 = add_cross(error2, theta, (carries_workpiece(rank) ? moved : error1) + 0.5 * turned);
        error1 = moved + turned;
        const Vector3Of<N> delta_slope = scales.template expanded_slope<axis>(place.delta_slope());
        of_axis<axis>(slope) = add_cross(of_axis<axis>(slope) + delta_slope, place.theta_slope(), lever);
        if (!carries_workpiece(rank)) of_axis<axis>(lever) += position;
    }

    std::array<AxisTable, 3> tables_;  // X, Y, Z
    std::array<int, 3> order_;         // axes from workpiece to tool
    int axes_before_bed_ = 0;
    std::array<double, 3> volume_;
    double margin_;
};

}  // namespace stepdiag
