// The exact error of the machine (machine.hpp) from tables that are ready for use. From the tool to the workpiece, each
// axis moves a point that nominally stands at n, the lever of the axis, and really at n + d:
//   after the bed    d <- d + (Exp theta - I)(n + d) + delta(p)
//   before the bed   d <- d + delta(p),   then   d <- d + (Exp theta - I)(n + d)
// The last d is the error: no large numbers are ever subtracted.
#pragma once

#include <array>

#include "controller/axis_table.hpp"
#include "controller/vector3.hpp"
#include "stepdiag/machine/chain.hpp"

namespace stepdiag {

// Of one axis, rad: machine tools have a tenth of it.
inline constexpr double largest_angle = 2e-3;

// (Exp theta - I) v = sin|theta|/|theta| theta x (v + tan(|theta|/2)/|theta| theta x v), both factors by their series.
// What these leave out is |theta|^5 |v| / 120 at most: 3e-16 |v| at the largest angle, 1e-12 mm at 4 m.
STEPDIAG_INLINED Vector3 turned(const Vector3& theta, const Vector3& v) noexcept {
    const double angle2 = dot(theta, theta);
    const Vector3 sine = (1.0 - angle2 * (1.0 / 6.0)) * theta, tangent = (0.5 + angle2 * (1.0 / 24.0)) * theta;
    return cross(sine, v + cross(tangent, v));
}

// Axes from workpiece to tool, X, Y, Z = 0, 1, 2. Where it is known when the code is compiled, no component is looked
// up.
template <int first, int second, int third>
struct AxisOrder {};

class ErrorModel {
public:
    // Of positions up to `margin` outside the volume.
    ErrorModel(const Chain& chain, const ErrorMap& errors, const std::array<double, 3>& volume, double margin,
               CompensatedApproach approach);

    // The intervals in which a position's axes are.
    struct Cell {
        const AxisInterval *x, *y, *z;

        bool holds(const Vector3& p) const noexcept { return x->holds(p.x) && y->holds(p.y) && z->holds(p.z); }
        template <int axis>
        const AxisInterval& at() const noexcept {
            return axis == 0 ? *x : axis == 1 ? *y : *z;
        }
    };
    STEPDIAG_INLINED Cell cell(const Vector3& p) const noexcept {
        return {&tables_[0].find(p.x), &tables_[1].find(p.y), &tables_[2].find(p.z)};
    }

    template <int first, int second, int third>
    STEPDIAG_INLINED Vector3 error(AxisOrder<first, second, third>, const Vector3& p, const Vector3& tool,
                                   const Cell& cell) const noexcept {
        Vector3 lever = tool, d = {0.0, 0.0, 0.0};
        move<third>(2, p, cell, lever, d);
        move<second>(1, p, cell, lever, d);
        move<first>(0, p, cell, lever, d);
        return d;
    }

    // The derivative of the error by position, to first order in the errors. Column a is
    //   delta_a' + theta_a' x lever_a + (sum of the thetas that turn the direction of a) x e_a
    template <int first, int second, int third>
    STEPDIAG_INLINED Matrix3 slope(AxisOrder<first, second, third>, const Vector3& p, const Vector3& tool,
                                   const Cell& cell) const noexcept {
        Matrix3 slope;
        Vector3 theta = {0.0, 0.0, 0.0}, lever = tool;
        turn_direction<first>(0, p, cell, theta, slope);
        turn_direction<second>(1, p, cell, theta, slope);
        turn_direction<third>(2, p, cell, theta, slope);
        add_slope<third>(2, p, cell, lever, slope);
        add_slope<second>(1, p, cell, lever, slope);
        add_slope<first>(0, p, cell, lever, slope);
        return slope;
    }

    // Rotation vector of the tool: that of the product of the axes' rotations.
    Vector3 orientation(const Vector3& p, const Cell& cell) const noexcept;

    // call(AxisOrder) with the order of this chain.
    template <class Call>
    STEPDIAG_INLINED auto in_order(Call&& call) const noexcept {
        switch (3 * order_[0] + order_[1]) {
            case 1: return call(AxisOrder<0, 1, 2>{});
            case 2: return call(AxisOrder<0, 2, 1>{});
            case 3: return call(AxisOrder<1, 0, 2>{});
            case 5: return call(AxisOrder<1, 2, 0>{});
            case 6: return call(AxisOrder<2, 0, 1>{});
            default: return call(AxisOrder<2, 1, 0>{});
        }
    }

    // Bounds over these positions and tools up to `largest_tool` long; see error_model.cpp.
    struct Bounds {
        double error;        // |e| <= error, mm
        double contraction;  // |e(p) - e(q)| <= contraction |p - q|, and |slope| <= contraction
    };
    Bounds bounds(double largest_tool) const;

private:
    bool carries_workpiece(int rank) const noexcept { return rank < axes_before_bed_; }

    template <int axis>
    STEPDIAG_INLINED void move(int rank, const Vector3& p, const Cell& cell, Vector3& lever,
                               Vector3& d) const noexcept {
        const AxisInterval& interval = cell.at<axis>();
        const double position = p.at<axis>();
        const Vector3 delta = interval.delta_at(position), theta = interval.theta_at(position);
        if (carries_workpiece(rank)) {
            lever.at<axis>() += position;
            d = d + delta;
            d = d + turned(theta, lever + d);
        } else {
            d = (d + delta) + turned(theta, lever + d);
            lever.at<axis>() += position;
        }
    }

    // theta: the sum up to here.
    template <int axis>
    STEPDIAG_INLINED void turn_direction(int rank, const Vector3& p, const Cell& cell, Vector3& theta,
                                         Matrix3& slope) const noexcept {
        const Vector3 before = theta;
        theta = theta + cell.at<axis>().theta_at(p.at<axis>());
        slope.column<axis>() = cross(carries_workpiece(rank) ? theta : before, unit<axis>());
    }
    template <int axis>
    STEPDIAG_INLINED void add_slope(int rank, const Vector3& p, const Cell& cell, Vector3& lever,
                                    Matrix3& slope) const noexcept {
        const AxisInterval& interval = cell.at<axis>();
        if (carries_workpiece(rank)) lever.at<axis>() += p.at<axis>();
        slope.column<axis>() = slope.column<axis>() + interval.delta_slope + cross(interval.theta_slope, lever);
        if (!carries_workpiece(rank)) lever.at<axis>() += p.at<axis>();
    }

    std::array<AxisTable, 3> tables_;  // by axis
    std::array<int, 3> order_;         // of axes, from workpiece to tool
    int axes_before_bed_ = 0;
    std::array<double, 3> volume_;
    double margin_;
};

}  // namespace stepdiag
