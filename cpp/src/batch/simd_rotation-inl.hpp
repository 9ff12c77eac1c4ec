// Vectors of space and small rotations with a lane for each set of readings.
#if defined(STEPDIAG_SIMD_ROTATION_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_SIMD_ROTATION_INL
#undef STEPDIAG_SIMD_ROTATION_INL
#else
#define STEPDIAG_SIMD_ROTATION_INL
#endif

#include <hwy/highway.h>

#include <Eigen/Core>

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

struct Vector3 {
    Vector x, y, z;
};

HWY_INLINE Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vector3 operator-(const Vector3& a) { return {hn::Neg(a.x), hn::Neg(a.y), hn::Neg(a.z)}; }
HWY_INLINE Vector dot(const Vector3& a, const Vector3& b) {
    return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
HWY_INLINE Vector3 cross(const Vector3& a, const Vector3& b) {
    return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
            hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
// a + factor b
HWY_INLINE Vector3 add_scaled(const Vector3& a, Vector factor, const Vector3& b) {
    return {hn::MulAdd(factor, b.x, a.x), hn::MulAdd(factor, b.y, a.y), hn::MulAdd(factor, b.z, a.z)};
}

struct Matrix3 {
    Vector3 row0, row1, row2;
};

HWY_INLINE Vector3 operator*(const Matrix3& m, const Vector3& v) {
    return {dot(m.row0, v), dot(m.row1, v), dot(m.row2, v)};
}
HWY_INLINE Vector3 transposed_product(const Matrix3& m, const Vector3& v) {
    const Vector3 first{hn::Mul(v.x, m.row0.x), hn::Mul(v.x, m.row0.y), hn::Mul(v.x, m.row0.z)};
    return add_scaled(add_scaled(first, v.y, m.row1), v.z, m.row2);
}
HWY_INLINE Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
    const auto row = [&](const Vector3& r) HWY_ATTR { return transposed_product(b, r); };
    return {row(a.row0), row(a.row1), row(a.row2)};
}

// The same in all lanes.
HWY_INLINE Vector3 common3(const double* v) {
    return {hn::Set(Tag(), v[0]), hn::Set(Tag(), v[1]), hn::Set(Tag(), v[2])};
}
HWY_INLINE Matrix3 common9(const Eigen::Matrix3d& m) {
    const auto row = [&](int i) HWY_ATTR {
        return Vector3{hn::Set(Tag(), m(i, 0)), hn::Set(Tag(), m(i, 1)), hn::Set(Tag(), m(i, 2))};
    };
    return {row(0), row(1), row(2)};
}

// core/rotation.hpp by series, whose next terms are below 1e-17 of the first up to 0.1 rad.
constexpr double largest_angle2 = 1e-2;

template <std::size_t terms>
HWY_INLINE Vector series(const double (&coefficient)[terms], Vector x) {
    Vector sum = hn::Set(Tag(), coefficient[terms - 1]);
    for (std::size_t k = terms - 1; k-- > 0;) sum = hn::MulAdd(sum, x, hn::Set(Tag(), coefficient[k]));
    return sum;
}
constexpr double sinc_series[] = {1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880};
constexpr double versine_series[] = {1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320, 1.0 / 3628800};   // (1 - cos)/t^2
constexpr double sine_series[] = {1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880, 1.0 / 39916800};  // (t - sin)/t^3

// Exp(v), angle2 = |v|^2.
HWY_INLINE Matrix3 rotation_exp(const Vector3& v, Vector angle2) {
    const Vector sinc = series(sinc_series, angle2), versine = series(versine_series, angle2);
    const Vector3 s{hn::Mul(sinc, v.x), hn::Mul(sinc, v.y), hn::Mul(sinc, v.z)};
    const Vector3 c{hn::Mul(versine, v.x), hn::Mul(versine, v.y), hn::Mul(versine, v.z)};
    const Vector one = hn::Set(Tag(), 1.0);
    const Vector xx = hn::Mul(c.x, v.x), yy = hn::Mul(c.y, v.y), zz = hn::Mul(c.z, v.z);
    return {{hn::Sub(one, hn::Add(yy, zz)), hn::MulSub(c.x, v.y, s.z), hn::MulAdd(c.x, v.z, s.y)},
            {hn::MulAdd(c.x, v.y, s.z), hn::Sub(one, hn::Add(xx, zz)), hn::MulSub(c.y, v.z, s.x)},
            {hn::MulSub(c.x, v.z, s.y), hn::MulAdd(c.y, v.z, s.x), hn::Sub(one, hn::Add(xx, yy))}};
}

// J(v)^T h, J as in core/rotation.hpp.
HWY_INLINE Vector3 transposed_jacobian(const Vector3& v, Vector angle2, const Vector3& h) {
    const Vector3 once = cross(v, h), twice = cross(v, once);
    return add_scaled(add_scaled(h, hn::Neg(series(versine_series, angle2)), once), series(sine_series, angle2), twice);
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
