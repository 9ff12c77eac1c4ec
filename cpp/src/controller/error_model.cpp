#include "controller/error_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Vector3d;

Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

// Exp theta as a quaternion, off by less than 1e-16 up to largest_angle.
Eigen::Quaterniond rotation(const Vector3d& theta) noexcept {
    const double angle2 = theta.squaredNorm();
    const double cosine = 1.0 - angle2 * (1.0 / 8.0 - angle2 / 384.0);
    const Vector3d sine = (0.5 - angle2 * (1.0 / 48.0 - angle2 / 3840.0)) * theta;
    return {cosine, sine.x(), sine.y(), sine.z()};
}

// What one axis does at most, over a range of positions.
struct Extremes {
    double delta = 0.0, delta_slope = 0.0, theta = 0.0, theta_slope = 0.0;
};

// Linear pieces are longest at their ends.
Extremes extremes(const AxisTable& table, double lowest, double highest) {
    Extremes most;
    for (const AxisInterval& interval : table)
        for (const double end : {std::max(interval.lower, lowest), std::min(interval.upper, highest)}) {
            most.delta = std::max(most.delta, interval.delta_at(end).norm());
            most.theta = std::max(most.theta, interval.theta_at(end).norm());
            most.delta_slope = std::max(most.delta_slope, vector(interval.delta_slope).norm());
            most.theta_slope = std::max(most.theta_slope, vector(interval.theta_slope).norm());
        }
    return most;
}

}  // namespace

ErrorModel::ErrorModel(const Chain& chain, const ErrorMap& errors, const Vector3d& volume, CompensatedApproach approach)
    : tables_{AxisTable(errors, Axis::X, volume.x(), approach), AxisTable(errors, Axis::Y, volume.y(), approach),
              AxisTable(errors, Axis::Z, volume.z(), approach)},
      axes_before_bed_(0),
      volume_(volume) {
    for (int rank = 0; rank < 3; ++rank) {
        order_[rank] = index(chain.order()[rank]);
        axes_before_bed_ += chain.carries_workpiece(chain.order()[rank]);
    }
}

Vector3d ErrorModel::orientation(const Vector3d& position, const Cell& cell) const noexcept {
    const auto turn = [&](int axis) { return rotation(cell[axis]->theta_at(position[axis])); };
    const Vector3d half_sine = (turn(order_[0]) * turn(order_[1]) * turn(order_[2])).vec();
    // 2 asin(s)/s; its next term is 2e-13 of the vector where all three axes turn by largest_angle.
    const double s2 = half_sine.squaredNorm();
    return (2.0 + s2 * (1.0 / 3.0 + s2 * (3.0 / 20.0))) * half_sine;
}

// With the point's distance from the joint of axis a never more than reach_a = |tool| + sum of |p_j| + |delta_j| from a
// to the tool (rotations keep lengths):
//   |e| <= sum |delta_a| + |theta_a| reach_a
//   |de/dp_a| <= |delta_a'| + |theta_a'| reach_a + sum of |theta| over the rotations that turn the direction of a
// (|d Exp(theta)/dp| <= |theta'|). The root of the sum of squares of these three columns bounds the matrix de/dp, and
// with it, because e is continuous, how far the errors at two positions can differ.
ErrorModel::Bounds ErrorModel::bounds(double margin, double largest_tool) const {
    std::array<Extremes, 3> most;
    for (int axis = 0; axis < 3; ++axis) most[axis] = extremes(tables_[axis], -margin, volume_[axis] + margin);
    double reach = largest_tool, error = 0.0, squares = 0.0;
    for (int rank = 2; rank >= 0; --rank) {
        const int axis = order_[rank];
        if (!(most[axis].theta <= largest_angle))
            throw InvalidArgument(std::string("axis ") + letter(Axis(axis)) + ": expected rotations of at most " +
                                  std::to_string(largest_angle) + " rad, got " + std::to_string(most[axis].theta));
        const double farther = reach + volume_[axis] + margin + most[axis].delta;
        const bool carries_workpiece = rank < axes_before_bed_;
        double slope = most[axis].delta_slope + most[axis].theta_slope * (carries_workpiece ? farther : reach);
        for (int before = 0; before < rank + carries_workpiece; ++before) slope += most[order_[before]].theta;
        error += most[axis].delta + most[axis].theta * (carries_workpiece ? farther : reach);
        squares += slope * slope;
        reach = farther;
    }
    return {error, std::sqrt(squares)};
}

}  // namespace stepdiag
