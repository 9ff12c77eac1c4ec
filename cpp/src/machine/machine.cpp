#include "stepdiag/machine/machine.hpp"

#include <Eigen/Geometry>

#include "machine/pose-inl.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

using namespace STEPDIAG_NAMESPACE;

Eigen::Vector3d angular_lever(const Chain& chain, const Eigen::Vector3d& tool, Axis axis,
                              const Eigen::Vector3d& commanded) {
    Eigen::Vector3d lever = tool;
    for (const Axis other : all_axes)
        if (chain.is_after(other, axis) || (other == axis && chain.carries_workpiece(axis)))
            lever[index(other)] += commanded[index(other)];
    return lever;
}

Machine::Machine(Chain chain, ErrorMap errors, const Eigen::Vector3d& tool)
    : chain_(chain), errors_(std::move(errors)), tool_(tool) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
}

Pose Machine::pose(const Eigen::Vector3d& commanded, const Approaches& approach,
                   const Eigen::Vector3d& expansion) const {
    const auto motion = [&](int rank) -> AxisMotion<double> {
        const Axis axis = chain_.order()[rank];
        const double p = commanded[index(axis)];
        const Approach came = approach[index(axis)];
        const Eigen::Vector3d shift =
            (p + expansion[index(axis)]) * Eigen::Vector3d::Unit(index(axis)) + errors_.delta(axis, p, came);
        return {rotation_exp(broadcast3<double>(errors_.theta(axis, p, came))), broadcast3<double>(shift),
                chain_.carries_workpiece(axis)};
    };
    const ChainPose<double> pose = chain_pose({motion(0), motion(1), motion(2)}, broadcast3<double>(tool_));
    return {to_eigen(pose.rotation), to_eigen(pose.position)};
}

Eigen::Vector3d Machine::error(const Eigen::Vector3d& commanded, const Approaches& approach) const {
    return pose(commanded, approach).position - commanded - tool_;
}

Eigen::Vector3d Machine::first_order_error(const Eigen::Vector3d& commanded, const Approaches& approach) const {
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    for (const Axis axis : all_axes) {
        const double p = commanded[index(axis)];
        const Approach came = approach[index(axis)];
        error += errors_.delta(axis, p, came) +
                 errors_.theta(axis, p, came).cross(angular_lever(chain_, tool_, axis, commanded));
    }
    return error;
}

}  // namespace stepdiag
