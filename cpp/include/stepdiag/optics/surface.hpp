// Optical surfaces: reflection and refraction at a face.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

namespace stepdiag {

enum class Surface {
    reflecting,  // reflects the share `reflectance`, absorbs the rest
    absorbing,
    refracting,  // refracts or totally reflects all light
    splitting,   // reflects the share `reflectance`, absorbs `absorptance`, refracts the rest; in the case of total
                 // internal reflection, reflects all light that it does not absorb
};

// Law of reflection, r = d - 2(n.d)n. The unit normal may point to either side.
inline Eigen::Vector3d reflect(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal) {
    return direction - 2.0 * normal.dot(direction) * normal;
}

// Snell's law in vector form. With the normal n directed against the light, c = -n.d, and mu = n1/n2 (index before over
// index behind the face):
//   r = mu d + (mu c - sqrt(1 - mu^2 (1 - c^2))) n
// `direction` and `normal` are unit vectors; the normal may point to either side. Empty in the case of total internal
// reflection, where the root is imaginary.
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
