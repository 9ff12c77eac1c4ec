#include "stepdiag/core/rotation.hpp"

#include "core/rotation-inl.hpp"

namespace stepdiag {

using namespace STEPDIAG_NAMESPACE;

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector) {
    return to_eigen(rotation_exp(broadcast3<double>(rotation_vector)));
}

Eigen::Matrix3d rotation_jacobian(const Eigen::Vector3d& rotation_vector) {
    return to_eigen(rotation_jacobian(broadcast3<double>(rotation_vector)));
}

}  // namespace stepdiag
