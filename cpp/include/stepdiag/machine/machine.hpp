// A three-axis machine: where the tool really is when the controller says `commanded`.
// Pose, exact, multiplied from workpiece to tool (Exp = exact rotation of a rotation vector):
//   axis before the bed:  Rot(Exp theta_a) Trans(p e_a + delta_a)
//   axis after the bed:   Trans(p e_a + delta_a) Rot(Exp theta_a)
//   last:                 Trans(tool offset)
// with the errors of the direction in which each axis came to where it stands. What the scales' expansion
// (machine/expansion.hpp) adds to a position p is added to delta_a along the axis.
#pragma once

#include <Eigen/Core>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace stepdiag {

// Position and orientation of the tool in the machine frame.
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // machine_R_tool
    Eigen::Vector3d position = Eigen::Vector3d::Zero();      // functional point, tool offset included, mm
};

// L_a: the lever by which theta_a moves the functional point to first order, e = sum_a (delta_a + theta_a x L_a):
// tool offset + positions of the axes after a, plus p_a itself where a carries the workpiece.
Eigen::Vector3d angular_lever(const Chain& chain, const Eigen::Vector3d& tool, Axis axis,
                              const Eigen::Vector3d& commanded);

class Machine {
public:
    // `tool` is the offset of the functional point from the tool's origin, mm.
    Machine(Chain chain, ErrorMap errors, const Eigen::Vector3d& tool = Eigen::Vector3d::Zero());

    // `expansion`: what that of each axis's scale adds to its position, mm.
    Pose pose(const Eigen::Vector3d& commanded, const Approaches& approach = all_positive,
              const Eigen::Vector3d& expansion = Eigen::Vector3d::Zero()) const;
    // Actual minus nominal functional point, exact / to first order in the errors, mm.
    Eigen::Vector3d error(const Eigen::Vector3d& commanded, const Approaches& approach = all_positive) const;
    Eigen::Vector3d first_order_error(const Eigen::Vector3d& commanded,
                                      const Approaches& approach = all_positive) const;

    const Chain& chain() const { return chain_; }
    const ErrorMap& errors() const { return errors_; }
    const Eigen::Vector3d& tool() const { return tool_; }

private:
    Chain chain_;
    ErrorMap errors_;
    Eigen::Vector3d tool_;
};

}  // namespace stepdiag
