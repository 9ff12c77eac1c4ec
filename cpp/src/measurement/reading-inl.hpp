// What a head reads of a mirror (stepdiag/measurement/reading.hpp), and how a set-up places the two.
#if defined(STEPDIAG_READING_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_READING_INL
#undef STEPDIAG_READING_INL
#else
#define STEPDIAG_READING_INL
#endif

#include "core/rotation-inl.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

// The unknowns of a line's set-up that place head and mirror; the rotations as vectors.
template <class N>
struct Placing {
    Vector3<N> reflector, laser;  // (a, b, 0)
    Vector3<N> roll;              // (0, 0, c)
    Vector3<N> lateral;           // (x, y, 0), of the beam, in the frame of the line
};
template <class N>
struct Placed {
    Matrix3<N> machine_R_sensor, tool_R_mirror;
    Vector3<N> origin;  // of the beam
};
// `origin`: of the beam on a well aligned line.
template <class N>
STEPDIAG_INLINE Placed<N> place_setup(const Matrix3<N>& machine_R_line, const Vector3<N>& origin,
                                      const Placing<N>& by) {
    return {machine_R_line * (rotation_exp(by.laser) * rotation_exp(by.roll)),
            machine_R_line * rotation_exp(by.reflector), machine_R_line * by.lateral + origin};
}

template <class N>
struct MirrorReading {
    N length;  // L
    N distance, alpha, beta;
    N w, inverse_w;  // 1 - tan^2 phi
};

// Of the plane through q with normal m, of any length, in the sensor frame; `inverse_z` = 1/m_z.
template <class N>
STEPDIAG_INLINE MirrorReading<N> read_plane(const Vector3<N>& q, const Vector3<N>& m, N inverse_z) {
    const N alpha = negative(m.y * inverse_z), beta = m.x * inverse_z, one = broadcast(Type<N>(), 1.0);
    const N length = mul_add(beta, q.x, sub_mul(alpha, q.y, q.z));
    const N w = sub_mul(alpha, alpha, sub_mul(beta, beta, one)), inverse_w = one / w;
    return {length, length * inverse_w, alpha, beta, w, inverse_w};
}

// By how much the outgoing beam from (u, v) is longer than that from the origin.
template <class N>
STEPDIAG_INLINE N beam_arm(const MirrorReading<N>& reading, N u, N v) {
    return sub_mul(reading.beta, u, reading.alpha * v);
}
template <class N>
STEPDIAG_INLINE N beam_distance(const MirrorReading<N>& reading, N arm) {
    return mul_add(arm, reading.inverse_w, reading.distance);
}
// spot = lever (-beta, alpha)
template <class N>
STEPDIAG_INLINE N spot_lever(const MirrorReading<N>& reading, N arm, N psd_distance) {
    const N half = mul_add(psd_distance + arm, reading.inverse_w, reading.distance);
    return half + half;
}
template <class N>
struct Spot {
    N x, y;
};
// `zero`: what a centred spot reads.
template <class N>
STEPDIAG_INLINE Spot<N> spot_reading(const MirrorReading<N>& reading, N lever, N zero_x, N zero_y) {
    return {sub_mul(lever, reading.beta, zero_x), mul_add(lever, reading.alpha, zero_y)};
}
// What a set-up adds to its distances: constant, drift, and a factor of their travel.
template <class N>
STEPDIAG_INLINE N distance_added(N constant, N drift, N time, N factor, N travel) {
    return mul_add(factor, travel, mul_add(drift, time, constant));
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
