// Vectors of space and 3 x 3 matrices of any number type (number.hpp).
#if defined(STEPDIAG_SPACE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_SPACE_INL
#undef STEPDIAG_SPACE_INL
#else
#define STEPDIAG_SPACE_INL
#endif

#include <Eigen/Core>

#include "core/number.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

template <class N>
struct Vector3 {
    N x, y, z;
};

template <class N>
STEPDIAG_INLINE Vector3<N> operator+(const Vector3<N>& a, const Vector3<N>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class N>
STEPDIAG_INLINE Vector3<N> operator-(const Vector3<N>& a, const Vector3<N>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class N>
STEPDIAG_INLINE Vector3<N> operator-(const Vector3<N>& a) {
    return {negative(a.x), negative(a.y), negative(a.z)};
}
template <class N>
STEPDIAG_INLINE Vector3<N> operator*(N factor, const Vector3<N>& a) {
    return {factor * a.x, factor * a.y, factor * a.z};
}
template <class N>
STEPDIAG_INLINE N dot(const Vector3<N>& a, const Vector3<N>& b) {
    return mul_add(a.z, b.z, mul_add(a.y, b.y, a.x * b.x));
}
template <class N>
STEPDIAG_INLINE Vector3<N> cross(const Vector3<N>& a, const Vector3<N>& b) {
    return {sub_mul(a.z, b.y, a.y * b.z), sub_mul(a.x, b.z, a.z * b.x), sub_mul(a.y, b.x, a.x * b.y)};
}
// a + factor b
template <class N>
STEPDIAG_INLINE Vector3<N> add_scaled(const Vector3<N>& a, N factor, const Vector3<N>& b) {
    return {mul_add(factor, b.x, a.x), mul_add(factor, b.y, a.y), mul_add(factor, b.z, a.z)};
}

template <class N>
struct Matrix3 {
    Vector3<N> row0, row1, row2;
};

template <class N>
STEPDIAG_INLINE Matrix3<N> transpose(const Matrix3<N>& m) {
    return {{m.row0.x, m.row1.x, m.row2.x}, {m.row0.y, m.row1.y, m.row2.y}, {m.row0.z, m.row1.z, m.row2.z}};
}
template <class N>
STEPDIAG_INLINE Vector3<N> operator*(const Matrix3<N>& m, const Vector3<N>& v) {
    return {dot(m.row0, v), dot(m.row1, v), dot(m.row2, v)};
}
template <class N>
STEPDIAG_INLINE Vector3<N> transposed_product(const Matrix3<N>& m, const Vector3<N>& v) {
    return add_scaled(add_scaled(v.x * m.row0, v.y, m.row1), v.z, m.row2);
}
template <class N>
STEPDIAG_INLINE Matrix3<N> operator*(const Matrix3<N>& a, const Matrix3<N>& b) {
    return {transposed_product(b, a.row0), transposed_product(b, a.row1), transposed_product(b, a.row2)};
}

// The same in all lanes.
template <class N>
STEPDIAG_INLINE Vector3<N> broadcast3(const double* v) {
    const Type<N> n;
    return {broadcast(n, v[0]), broadcast(n, v[1]), broadcast(n, v[2])};
}
template <class N>
STEPDIAG_INLINE Vector3<N> broadcast3(const Eigen::Vector3d& v) {
    return broadcast3<N>(v.data());
}
template <class N>
STEPDIAG_INLINE Matrix3<N> broadcast9(const double* rows) {
    return {broadcast3<N>(rows), broadcast3<N>(rows + 3), broadcast3<N>(rows + 6)};
}
template <class N>
STEPDIAG_INLINE Matrix3<N> broadcast9(const Eigen::Matrix3d& m) {
    return transpose(broadcast9<N>(m.data()));
}

inline Eigen::Vector3d to_eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }
inline Eigen::Matrix3d to_eigen(const Matrix3<double>& m) {
    Eigen::Matrix3d result;
    result << m.row0.x, m.row0.y, m.row0.z, m.row1.x, m.row1.y, m.row1.z, m.row2.x, m.row2.y, m.row2.z;
    return result;
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
