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
    for (std::size_t i = 0; i < table.size(); ++i)
        for (const double end :
             {i == 0 ? lowest : *table[i].start, i + 1 == table.size() ? highest : table[i].start[1]}) {
            most.delta = std::max(most.delta, norm(table[i].at(end).delta));
            most.theta = std::max(most.theta, norm(table[i].at(end).theta));
            most.delta_slope = std::max(most.delta_slope, norm(table[i].delta_slope()));
            most.theta_slope = std::max(most.theta_slope, norm(table[i].theta_slope()));
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
// `slope` has column a to first order. What it leaves out is, with the sum T of all |theta|, at most
//   T |delta_a'| + |theta_a'| (2 T reach_a + |e|) + T^2
// and over a distance s within a cell the column changes by at most (|theta_a'| + sum |theta'|) s.
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
    double reach = largest_tool, error = 0.0, turned = 0.0, turned_slope = 0.0;
    std::array<double, 3> reach_of, slope = {};
    for (int rank = 2; rank >= 0; --rank) {
        const int axis = order_[rank];
        if (!(most[axis].theta <= largest_angle))
            throw InvalidArgument(std::string("axis ") + letter(Axis(axis)) + ": expected rotations of at most " +
                                  std::to_string(largest_angle) + " rad, got " + std::to_string(most[axis].theta));
        const double farther = reach + volume_[axis] + margin_ + most[axis].delta;
        const bool workpiece = carries_workpiece(rank);
        reach_of[axis] = workpiece ? farther : reach;
        for (int before = 0; before < rank + workpiece; ++before) slope[axis] += most[order_[before]].theta;
        slope[axis] += most[axis].delta_slope + most[axis].theta_slope * reach_of[axis];
        error += most[axis].delta + most[axis].theta * reach_of[axis];
        turned += most[axis].theta;
        turned_slope += most[axis].theta_slope;
        reach = farther;
    }
    double slope2 = 0.0, bend2 = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double left_out = turned * (most[axis].delta_slope + 2.0 * most[axis].theta_slope * reach_of[axis]) +
                                most[axis].theta_slope * error + turned * turned;
        const double change = 2.0 * turned_slope * 3.0 * error;
        slope2 += slope[axis] * slope[axis];
        bend2 += (left_out + change) * (left_out + change);
    }
    return {error, std::sqrt(slope2), std::sqrt(bend2)};
}

}  // namespace stepdiag
