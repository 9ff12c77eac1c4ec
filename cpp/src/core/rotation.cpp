#include "stepdiag/core/rotation.hpp"

#include <cmath>

namespace stepdiag {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
    Eigen::Matrix3d cross;
    cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return cross;
}

}  // namespace

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector) {
    const Eigen::Vector3d& v = rotation_vector;
    const double angle2 = v.squaredNorm();
    double sinc = 1.0 - angle2 / 6.0;      // error angle^4/120 < 1e-18 below 1e-4 rad
    double versine = 0.5 - angle2 / 24.0;  // (1 - cos)/angle^2
    if (angle2 > 1e-8) {
        const double angle = std::sqrt(angle2);
        const double half_sine = std::sin(0.5 * angle);
        sinc = std::sin(angle) / angle;
        versine = 2.0 * half_sine * half_sine / angle2;  // 1 - cos without cancellation
    }
    const Eigen::Matrix3d cross = cross_matrix(v);
    return Eigen::Matrix3d::Identity() + sinc * cross + versine * (cross * cross);
}

Eigen::Matrix3d rotation_jacobian(const Eigen::Vector3d& rotation_vector) {
    const double angle2 = rotation_vector.squaredNorm();
    // Series up to 0.1 rad, where their next terms are 1e-16 and less of the first.
    double versine = 1.0 / 2 - angle2 * (1.0 / 24 - angle2 * (1.0 / 720 - angle2 * (1.0 / 40320 - angle2 / 3628800)));
    double sine = 1.0 / 6 - angle2 * (1.0 / 120 - angle2 * (1.0 / 5040 - angle2 * (1.0 / 362880 - angle2 / 39916800)));
    if (angle2 > 1e-2) {
        const double angle = std::sqrt(angle2);
        versine = (1.0 - std::cos(angle)) / angle2;
        sine = (angle - std::sin(angle)) / (angle2 * angle);
    }
    const Eigen::Matrix3d cross = cross_matrix(rotation_vector);
    return Eigen::Matrix3d::Identity() + versine * cross + sine * (cross * cross);
}

}  // namespace stepdiag
