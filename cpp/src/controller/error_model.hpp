// The exact error of the machine (machine.hpp) from tables that are ready for use. From the tool to the workpiece, each
// axis moves a point that nominally stands at n, the lever of the axis, and really at n + d:
//   after the bed    d <- d + (Exp theta - I)(n + d) + delta(p)
//   before the bed   d <- d + delta(p),   then   d <- d + (Exp theta - I)(n + d)
// The last d is the error: no large numbers are ever subtracted. (Exp theta - I) v = a theta x v + b theta x (theta x
// v) with a = 1 - |theta|^2/6 + |theta|^4/120 and b = 1/2 - |theta|^2/24 + |theta|^4/720, which is off by less than
// |theta|^7 |v| / 5040: 2e-18 |v| at the largest angle that is let in.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "controller/axis_table.hpp"
#include "stepdiag/machine/chain.hpp"

namespace stepdiag {

inline constexpr double largest_angle = 0.01;  // rad, of one axis: machine tools have a hundredth of it

// (Exp theta - I) v
inline Eigen::Vector3d turned(const Eigen::Vector3d& theta, const Eigen::Vector3d& v) noexcept {
    const double angle2 = theta.squaredNorm();
    const double a = 1.0 - angle2 * (1.0 / 6.0 - angle2 / 120.0);
    const double b = 0.5 - angle2 * (1.0 / 24.0 - angle2 / 720.0);
    const Eigen::Vector3d w = theta.cross(v);
    return a * w + b * theta.cross(w);
}

class ErrorModel {
public:
    ErrorModel(const Chain& chain, const ErrorMap& errors, const Eigen::Vector3d& volume, CompensatedApproach approach);

    // The intervals in which a position's axes are.
    using Cell = std::array<const AxisInterval*, 3>;
    Cell cell(const Eigen::Vector3d& position) const noexcept {
        return {&tables_[0].find(position[0]), &tables_[1].find(position[1]), &tables_[2].find(position[2])};
    }
    // The same where `near`, the cell of a neighbour, most often is the one.
    Cell cell(const Eigen::Vector3d& position, const Cell& near) const noexcept {
        const bool same = near[0]->holds(position[0]) && near[1]->holds(position[1]) && near[2]->holds(position[2]);
        return same ? near : cell(position);
    }

    Eigen::Vector3d error(const Eigen::Vector3d& position, const Eigen::Vector3d& tool,
                          const Cell& cell) const noexcept {
        Eigen::Vector3d lever = tool, error = Eigen::Vector3d::Zero();
        for (int rank = 2; rank >= 0; --rank) {
            const int axis = order_[rank];
            const Eigen::Vector3d delta = cell[axis]->delta_at(position[axis]);
            const Eigen::Vector3d theta = cell[axis]->theta_at(position[axis]);
            if (rank < axes_before_bed_) {
                lever[axis] += position[axis];
                error += delta;
                error += turned(theta, lever + error);
            } else {
                error += turned(theta, lever + error) + delta;
                lever[axis] += position[axis];
            }
        }
        return error;
    }

    // Rotation vector of the tool: that of the product of the axes' rotations.
    Eigen::Vector3d orientation(const Eigen::Vector3d& position, const Cell& cell) const noexcept;

    // Bounds over positions up to `margin` outside the volume and tools up to `largest_tool` long; see error_model.cpp.
    struct Bounds {
        double error;        // |e| <= error, mm
        double contraction;  // |e(p) - e(q)| <= contraction |p - q|
    };
    Bounds bounds(double margin, double largest_tool) const;

private:
    std::array<AxisTable, 3> tables_;  // by axis
    std::array<int, 3> order_;         // of axes, from workpiece to tool
    int axes_before_bed_;
    Eigen::Vector3d volume_;
};

}  // namespace stepdiag
