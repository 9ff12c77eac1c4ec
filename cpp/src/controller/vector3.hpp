// Three numbers and what the compensator does with them: as plain scalars, which compilers keep in registers.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

// Whole evaluations in one piece: what is known of their arguments then shortens them.
#define STEPDIAG_INLINED [[gnu::always_inline]] inline

namespace stepdiag {

struct Vector3 {
    double x, y, z;

    // A component that is known when the code is compiled.
    template <int axis>
    double& at() noexcept {
        static_assert(axis >= 0 && axis < 3);
        if constexpr (axis == 0) return x;
        else if constexpr (axis == 1) return y;
        else return z;
    }
    template <int axis>
    double at() const noexcept {
        Vector3 copy = *this;
        return copy.at<axis>();
    }
};

STEPDIAG_INLINED Vector3 operator+(const Vector3& a, const Vector3& b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
STEPDIAG_INLINED Vector3 operator-(const Vector3& a, const Vector3& b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
STEPDIAG_INLINED Vector3 operator*(double s, const Vector3& v) noexcept { return {s * v.x, s * v.y, s * v.z}; }
STEPDIAG_INLINED double dot(const Vector3& a, const Vector3& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
STEPDIAG_INLINED Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <int axis>
constexpr Vector3 unit() noexcept {
    return {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
}
STEPDIAG_INLINED Vector3 clamp(const Vector3& v, const Vector3& lowest, const Vector3& highest) noexcept {
    return {std::min(std::max(v.x, lowest.x), highest.x), std::min(std::max(v.y, lowest.y), highest.y),
            std::min(std::max(v.z, lowest.z), highest.z)};
}

STEPDIAG_INLINED Vector3 vector3(const std::array<double, 3>& v) noexcept { return {v[0], v[1], v[2]}; }
inline Vector3 vector3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
STEPDIAG_INLINED std::array<double, 3> array(const Vector3& v) noexcept { return {v.x, v.y, v.z}; }

// Its columns.
struct Matrix3 {
    Vector3 x, y, z;

    template <int axis>
    Vector3& column() noexcept {
        if constexpr (axis == 0) return x;
        else if constexpr (axis == 1) return y;
        else return z;
    }
};
STEPDIAG_INLINED Vector3 operator*(const Matrix3& m, const Vector3& v) noexcept {
    return v.x * m.x + v.y * m.y + v.z * m.z;
}

}  // namespace stepdiag
