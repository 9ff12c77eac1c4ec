#include "controller/error_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

double norm(const Vector3& v) { return std::sqrt(dot(v, v)); }

// Largest values of one axis over a range of positions.
struct Extremes {
    double delta = 0.0, delta_slope = 0.0, theta = 0.0, theta_slope = 0.0;
};

// The largest length of a linear piece is at one of its ends.
Extremes extremes(const AxisTable& table, double lowest, double highest) {
    Extremes most;
    for (const AxisInterval& interval : table)
        for (const double end : {std::max(interval.lower, lowest), std::min(interval.upper, highest)}) {
            most.delta = std::max(most.delta, norm(interval.at(end).delta));
            most.theta = std::max(most.theta, norm(interval.at(end).theta));
            most.delta_slope = std::max(most.delta_slope, norm(interval.delta_slope()));
            most.theta_slope = std::max(most.theta_slope, norm(interval.theta_slope()));
        }
    return most;
}

}  // namespace

ErrorModel::ErrorModel(const Chain& chain, const ErrorMap& errors, const std::array<double, 3>& volume, double margin,
                       CompensatedApproach approach)
    : tables_{AxisTable(errors, Axis::X, volume[0], margin, approach),
              AxisTable(errors, Axis::Y, volume[1], margin, approach),
              AxisTable(errors, Axis::Z, volume[2], margin, approach)},
      volume_(volume),
      margin_(margin) {
    for (int rank = 0; rank < 3; ++rank) {
        order_[rank] = index(chain.order()[rank]);
        axes_before_bed_ += chain.carries_workpiece(chain.order()[rank]);
    }
}

// The distance of the point from the joint of axis a is at most reach_a = |tool| + sum of |p_j| + |delta_j| over the
// axes from a to the tool, because rotations preserve lengths. Hence:
//   |e| <= sum |delta_a| + |theta_a| reach_a
//   |de/dp_a| <= |delta_a'| + |theta_a'| reach_a + sum of |theta| over the rotations that turn the direction of a
// (|d Exp(theta)/dp| <= |theta'|). The root of the sum of squares of these three columns is a bound of the matrix
// de/dp. Because e is continuous, it also bounds the difference of the errors at two positions.
// The expansion of a scale adds rate (p - f) to delta_a and rate to delta_a'.
ErrorModel::Bounds ErrorModel::bounds(double largest_tool, const ExpandedScales& scales) const {
    const std::array<double, 3> rate = {scales.rate.x, scales.rate.y, scales.rate.z},
                                fixed = {scales.fixed_point.x, scales.fixed_point.y, scales.fixed_point.z};
    std::array<Extremes, 3> most;
    for (int axis = 0; axis < 3; ++axis) {
        const double lowest = -margin_, highest = volume_[axis] + margin_;
        most[axis] = extremes(tables_[axis], lowest, highest);
        most[axis].delta += rate[axis] * std::max(std::abs(lowest - fixed[axis]), std::abs(highest - fixed[axis]));
        most[axis].delta_slope += rate[axis];
    }
    double reach = largest_tool, error = 0.0, squares = 0.0;
    for (int rank = 2; rank >= 0; --rank) {
        const int axis = order_[rank];
        if (!(most[axis].theta <= largest_angle))
            throw InvalidArgument(std::string("axis ") + letter(Axis(axis)) + ": expected rotations of at most " +
                                  std::to_string(largest_angle) + " rad, got " + std::to_string(most[axis].theta));
        const double farther = reach + volume_[axis] + margin_ + most[axis].delta;
        const bool workpiece = carries_workpiece(rank);
        double slope = most[axis].delta_slope + most[axis].theta_slope * (workpiece ? farther : reach);
        for (int before = 0; before < rank + workpiece; ++before) slope += most[order_[before]].theta;
        error += most[axis].delta + most[axis].theta * (workpiece ? farther : reach);
        squares += slope * slope;
        reach = farther;
    }
    return {error, std::sqrt(squares)};
}

}  // namespace stepdiag
