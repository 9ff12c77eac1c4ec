// Thermal expansion of whatever positions the axes, as a rule their scales. From its fixed point f_a the scale of axis
// a expands by its coefficient alpha_a, so that the axis, told to go to p, stands at
//   p + alpha_a (T_a - T_ref)(p - f_a)
// T_a the scale's temperature. In the pose (machine/machine.hpp) the last term is added to the axis's translation along
// itself; delta_a and theta_a are those of the commanded p. Positioning errors of which this is taken off are referred
// to T_ref.
#pragma once

#include <Eigen/Core>

namespace stepdiag {

struct Expansion {
    Eigen::Vector3d coefficient = Eigen::Vector3d::Zero();  // by axis, 1/K
    Eigen::Vector3d fixed_point = Eigen::Vector3d::Zero();  // by axis, mm
    double reference = 20.0;                                // degrees Celsius

    // By axis: (T_a - T_ref)(p - f_a), mm K.
    Eigen::Vector3d stretch(const Eigen::Vector3d& commanded, const Eigen::Vector3d& temperature) const {
        return (temperature.array() - reference) * (commanded - fixed_point).array();
    }
    // By axis, mm.
    Eigen::Vector3d shift(const Eigen::Vector3d& commanded, const Eigen::Vector3d& temperature) const {
        return coefficient.cwiseProduct(stretch(commanded, temperature));
    }
};

// Throws InvalidArgument for a coefficient beyond 1e-3/K or a number that is not finite.
void check(const Expansion& expansion);

}  // namespace stepdiag
