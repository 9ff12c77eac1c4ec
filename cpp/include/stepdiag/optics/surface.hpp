// What a face does to light.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

namespace stepdiag {

enum class Surface {
    reflecting,  // reflects the share `reflectance`, absorbs the rest
    absorbing,
    refracting,  // all light goes on, refracted or else totally reflected
    splitting,   // light goes both ways: `reflectance` back, `absorptance` lost, the rest on by Snell's law; where that
                 // has no solution, all that is not lost is totally reflected
};

// Law of reflection, r = d - 2(n.d)n, for a unit normal of either side.
inline Eigen::Vector3d reflect(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal) {
    return direction - 2.0 * normal.dot(direction) * normal;
}

// Snell's law in vector form. With the normal turned against the light, c = -n.d and mu = n1/n2 (index before /
// behind):
//   r = mu d + (mu c - sqrt(1 - mu^2 (1 - c^2))) n
// None where the root is imaginary: total internal reflection.
inline std::optional<Eigen::Vector3d> refract(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal,
                                              double index_ratio) {
    const double along = normal.dot(direction);
    const double cosine = std::abs(along);
    const double cosine2_behind = 1.0 - index_ratio * index_ratio * (1.0 - cosine * cosine);
    if (!(cosine2_behind >= 0.0)) return std::nullopt;
    const Eigen::Vector3d against = along > 0.0 ? Eigen::Vector3d(-normal) : normal;
    return index_ratio * direction + (index_ratio * cosine - std::sqrt(cosine2_behind)) * against;
}

}  // namespace stepdiag
