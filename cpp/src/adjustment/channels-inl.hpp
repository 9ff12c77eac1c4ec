// The raw channels of a reading with what a set-up adds to them: scale = 1 + gain of tilts, spots and beam offsets.
#if defined(STEPDIAG_CHANNELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_CHANNELS_INL
#undef STEPDIAG_CHANNELS_INL
#else
#define STEPDIAG_CHANNELS_INL
#endif

#include "measurement/reading-inl.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

// What is added to all distances of a set-up.
template <class N>
STEPDIAG_INLINE N distance_added(N constant, N drift, N time, N factor, N travel) {
    return mul_add(factor, travel, mul_add(drift, time, constant));
}
// Of the beam whose offset makes it longer by `arm`; without what is added.
template <class N>
STEPDIAG_INLINE N scaled_distance(const MirrorReading<N>& reading, N scale, N arm) {
    return beam_distance(reading, scale * arm);
}
template <class N>
struct RawSpot {
    N x, y;
};
template <class N>
STEPDIAG_INLINE RawSpot<N> raw_spot(const MirrorReading<N>& reading, N scaled_lever, N zero_x, N zero_y) {
    return {sub_mul(scaled_lever, reading.beta, zero_x), mul_add(scaled_lever, reading.alpha, zero_y)};
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
