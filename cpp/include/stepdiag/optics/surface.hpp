// What a face does to light.
#pragma once

#include <Eigen/Core>

namespace stepdiag {

enum class Surface { reflecting, absorbing };

// Law of reflection, r = d - 2(n.d)n, for a unit normal of either side.
inline Eigen::Vector3d reflect(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal) {
    return direction - 2.0 * normal.dot(direction) * normal;
}

}  // namespace stepdiag
