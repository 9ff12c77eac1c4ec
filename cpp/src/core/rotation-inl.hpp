// Rotations by their rotation vectors v (stepdiag/core/rotation.hpp), with t = |v| and [v]x the matrix of v x:
//   Exp(v) = I + sin t/t [v]x + (1 - cos t)/t^2 [v]x^2
//   J(v)   = I + (1 - cos t)/t^2 [v]x + (t - sin t)/t^3 [v]x^2      left Jacobian, Exp(v + dv) = Exp(J(v) dv) Exp(v)
#if defined(STEPDIAG_ROTATION_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_ROTATION_INL
#undef STEPDIAG_ROTATION_INL
#else
#define STEPDIAG_ROTATION_INL
#endif

#include <type_traits>

#include "core/space-inl.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

// By series up to 0.1 rad, where the next terms are below 1e-17 of the first. Lanes are told by their caller to stay
// below; other numbers are taken by their functions above.
constexpr double largest_angle2 = 1e-2;
constexpr double sinc_series[] = {1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880};
constexpr double versine_series[] = {1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320, 1.0 / 3628800};   // (1 - cos)/t^2
constexpr double sine_series[] = {1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880, 1.0 / 39916800};  // (t - sin)/t^3

template <std::size_t terms, class N>
STEPDIAG_INLINE N series(const double (&coefficient)[terms], N x) {
    const Type<N> n;
    N sum = broadcast(n, coefficient[terms - 1]);
    for (std::size_t k = terms - 1; k-- > 0;) sum = mul_add(sum, x, broadcast(n, coefficient[k]));
    return sum;
}

template <class N>
constexpr bool has_functions = std::is_same_v<Truth<N>, bool>;

// By t^2.
template <class N>
STEPDIAG_INLINE N sinc(N angle2) {
    using std::sin;
    if constexpr (has_functions<N>)
        if (angle2 > broadcast(Type<N>(), largest_angle2)) return sin(root(angle2)) / root(angle2);
    return series(sinc_series, angle2);
}
template <class N>
STEPDIAG_INLINE N versine(N angle2) {
    using std::sin;
    if constexpr (has_functions<N>)
        if (angle2 > broadcast(Type<N>(), largest_angle2)) {
            const N half_sine = sin(broadcast(Type<N>(), 0.5) * root(angle2));
            return (half_sine + half_sine) * half_sine / angle2;  // 1 - cos without cancellation
        }
    return series(versine_series, angle2);
}
template <class N>
STEPDIAG_INLINE N sine(N angle2) {
    using std::sin;
    if constexpr (has_functions<N>)
        if (angle2 > broadcast(Type<N>(), largest_angle2))
            return (root(angle2) - sin(root(angle2))) / (root(angle2) * angle2);
    return series(sine_series, angle2);
}

// I + a [v]x + b [v]x^2
template <class N>
STEPDIAG_INLINE Matrix3<N> cross_polynomial(const Vector3<N>& v, N a, N b) {
    const Vector3<N> s = a * v, c = b * v;
    const N one = broadcast(Type<N>(), 1.0);
    const N xy = c.x * v.y, xz = c.x * v.z, yz = c.y * v.z;
    const N less_xx = sub_mul(c.x, v.x, one), less_yy = sub_mul(c.y, v.y, one);
    return {{sub_mul(c.z, v.z, less_yy), xy - s.z, xz + s.y},
            {xy + s.z, sub_mul(c.z, v.z, less_xx), yz - s.x},
            {xz - s.y, yz + s.x, sub_mul(c.y, v.y, less_xx)}};
}
// The same times h.
template <class N>
STEPDIAG_INLINE Vector3<N> cross_polynomial(const Vector3<N>& v, N a, N b, const Vector3<N>& h) {
    const Vector3<N> once = cross(v, h);
    return add_scaled(add_scaled(h, a, once), b, cross(v, once));
}

template <class N>
STEPDIAG_INLINE Matrix3<N> rotation_exp(const Vector3<N>& v) {
    const N angle2 = dot(v, v);
    return cross_polynomial(v, sinc(angle2), versine(angle2));
}
// Exp(v) h
template <class N>
STEPDIAG_INLINE Vector3<N> rotate(const Vector3<N>& v, const Vector3<N>& h) {
    const N angle2 = dot(v, v);
    return cross_polynomial(v, sinc(angle2), versine(angle2), h);
}
template <class N>
STEPDIAG_INLINE Matrix3<N> rotation_jacobian(const Vector3<N>& v) {
    const N angle2 = dot(v, v);
    return cross_polynomial(v, versine(angle2), sine(angle2));
}
// J(v)^T h
template <class N>
STEPDIAG_INLINE Vector3<N> transposed_jacobian(const Vector3<N>& v, const Vector3<N>& h) {
    const N angle2 = dot(v, v);
    return cross_polynomial(v, negative(versine(angle2)), sine(angle2), h);
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
