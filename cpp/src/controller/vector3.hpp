// Vector operations of the compensator. Components are plain scalars, which compilers keep in registers.
#pragma once

#include <algorithm>
#include <array>

// Inlines whole evaluations, so that the compiler can use the known values of their arguments.
#define STEPDIAG_INLINED [[gnu::always_inline]] inline

namespace stepdiag {

struct Vector3 {
    double x, y, z;

    // A component with an index known at compile time.
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
// v + a x b, in an order that gives two fused multiply-adds for each component.
STEPDIAG_INLINED Vector3 add_cross(const Vector3& v, const Vector3& a, const Vector3& b) noexcept {
    return {(v.x - a.z * b.y) + a.y * b.z, (v.y - a.x * b.z) + a.z * b.x, (v.z - a.y * b.x) + a.x * b.y};
}
// v x e_axis
template <int axis>
STEPDIAG_INLINED Vector3 cross_unit(const Vector3& v) noexcept {
    if constexpr (axis == 0) return {0.0, v.z, -v.y};
    else if constexpr (axis == 1) return {-v.z, 0.0, v.x};
    else return {v.y, -v.x, 0.0};
}
STEPDIAG_INLINED Vector3 read(const double* v) noexcept { return {v[0], v[1], v[2]}; }
STEPDIAG_INLINED void write(const Vector3& v, double* out) noexcept { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

// Box of positions from `lowest` to `highest` in each component.
struct Box {
    Vector3 lowest, highest;

    STEPDIAG_INLINED bool holds(const Vector3& v) const noexcept {  // never NaN
        return lowest.x <= v.x && v.x <= highest.x && lowest.y <= v.y && v.y <= highest.y && lowest.z <= v.z &&
               v.z <= highest.z;
    }
    STEPDIAG_INLINED Vector3 nearest(const Vector3& v) const noexcept {
        return {std::min(std::max(v.x, lowest.x), highest.x), std::min(std::max(v.y, lowest.y), highest.y),
                std::min(std::max(v.z, lowest.z), highest.z)};
    }
    Box grown(double by) const noexcept {
        const Vector3 all = {by, by, by};
        return {lowest - all, highest + all};
    }
};

// A 3 x 3 matrix by its columns.
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
