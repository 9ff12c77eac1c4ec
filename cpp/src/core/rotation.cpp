#include "stepdiag/core/rotation.hpp"

#include <cmath>

namespace stepdiag {

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
    Eigen::Matrix3d cross;
    cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return Eigen::Matrix3d::Identity() + sinc * cross + versine * (cross * cross);
}

}  // namespace stepdiag
