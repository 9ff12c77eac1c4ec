// Exact rotations.
#pragma once

#include <Eigen/Core>

namespace stepdiag {

// Exp(v) = I + sinc(|v|) [v]x + (1 - cos|v|)/|v|^2 [v]x^2, the rotation by |v| about v (Rodrigues), right-handed.
// Below 1e-4 rad the two factors are summed as series, so that small rotations keep every digit of their second order.
Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector);

// J(v) with Exp(v + dv) = Exp(J(v) dv) Exp(v) to first order in dv: the left Jacobian
// I + (1 - cos|v|)/|v|^2 [v]x + (|v| - sin|v|)/|v|^3 [v]x^2. On the right, Exp(v + dv) = Exp(v) Exp(J(v)^T dv).
Eigen::Matrix3d rotation_jacobian(const Eigen::Vector3d& rotation_vector);

}  // namespace stepdiag
