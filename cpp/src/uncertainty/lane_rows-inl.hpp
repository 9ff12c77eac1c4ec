// Rows of lanes as vectors. Highway compiles this anew for every instruction set, hence the guard.
#if defined(STEPDIAG_LANE_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_LANE_ROWS_INL
#undef STEPDIAG_LANE_ROWS_INL
#else
#define STEPDIAG_LANE_ROWS_INL
#endif

#include "core/simd-inl.hpp"
#include "uncertainty/simd_pass.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {
namespace {

STEPDIAG_INLINE Pair common(double value) { return broadcast(Type<Pair>(), value); }
STEPDIAG_INLINE Pair at(const LaneRow& row, std::size_t lane) { return load(row.value + lane); }
STEPDIAG_INLINE MaskPair all_true() {
    const Pair zero = common(0.0);
    return zero <= zero;
}
STEPDIAG_INLINE void keep(MaskPair followed, std::uint8_t* to) {
    std::uint8_t here[2 * hn::MaxLanes(Tag())];
    store(followed, here);
    for (std::size_t i = 0; i < 2 * hn::Lanes(Tag()); ++i) to[i] &= here[i];
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
