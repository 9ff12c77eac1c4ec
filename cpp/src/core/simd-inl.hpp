// Vectors of lanes as a number type (number.hpp), one or two at a time.
#if defined(STEPDIAG_SIMD_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_SIMD_INL
#undef STEPDIAG_SIMD_INL
#else
#define STEPDIAG_SIMD_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "core/number.hpp"  // which looks whether Highway is there

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;

STEPDIAG_INLINE Vector mul_add(Vector a, Vector b, Vector c) { return hn::MulAdd(a, b, c); }
STEPDIAG_INLINE Vector sub_mul(Vector a, Vector b, Vector c) { return hn::NegMulAdd(a, b, c); }
STEPDIAG_INLINE Vector root(Vector a) { return hn::Sqrt(a); }
STEPDIAG_INLINE Vector magnitude(Vector a) { return hn::Abs(a); }
STEPDIAG_INLINE Vector negative(Vector a) { return hn::Neg(a); }
STEPDIAG_INLINE Vector with_sign(Vector a, Vector sign) { return hn::CopySignToAbs(a, sign); }
STEPDIAG_INLINE Mask both(Mask a, Mask b) { return hn::And(a, b); }
STEPDIAG_INLINE Vector broadcast(Type<Vector>, double value) { return hn::Set(Tag(), value); }
STEPDIAG_INLINE void store(Mask a, std::uint8_t* to) {
    std::uint8_t bits[8] = {};  // what Highway writes at least
    hn::StoreMaskBits(Tag(), a, bits);
    for (std::size_t i = 0; i < hn::Lanes(Tag()); ++i) to[i] = (bits[0] >> i) & 1;
}

// Two vectors side by side: while one waits for a root or a quotient, the other goes on.
struct Pair {
    Vector a, b;
};
struct MaskPair {
    Mask a, b;
};
STEPDIAG_INLINE Pair operator+(Pair x, Pair y) { return {x.a + y.a, x.b + y.b}; }
STEPDIAG_INLINE Pair operator-(Pair x, Pair y) { return {x.a - y.a, x.b - y.b}; }
STEPDIAG_INLINE Pair operator*(Pair x, Pair y) { return {x.a * y.a, x.b * y.b}; }
STEPDIAG_INLINE Pair operator/(Pair x, Pair y) { return {x.a / y.a, x.b / y.b}; }
STEPDIAG_INLINE MaskPair operator>(Pair x, Pair y) { return {x.a > y.a, x.b > y.b}; }
STEPDIAG_INLINE MaskPair operator<=(Pair x, Pair y) { return {x.a <= y.a, x.b <= y.b}; }
STEPDIAG_INLINE Pair mul_add(Pair x, Pair y, Pair z) { return {mul_add(x.a, y.a, z.a), mul_add(x.b, y.b, z.b)}; }
STEPDIAG_INLINE Pair sub_mul(Pair x, Pair y, Pair z) { return {sub_mul(x.a, y.a, z.a), sub_mul(x.b, y.b, z.b)}; }
STEPDIAG_INLINE Pair root(Pair x) { return {root(x.a), root(x.b)}; }
STEPDIAG_INLINE Pair magnitude(Pair x) { return {magnitude(x.a), magnitude(x.b)}; }
STEPDIAG_INLINE Pair negative(Pair x) { return {negative(x.a), negative(x.b)}; }
STEPDIAG_INLINE Pair with_sign(Pair x, Pair sign) { return {with_sign(x.a, sign.a), with_sign(x.b, sign.b)}; }
STEPDIAG_INLINE MaskPair both(MaskPair x, MaskPair y) { return {both(x.a, y.a), both(x.b, y.b)}; }
STEPDIAG_INLINE MaskPair either(MaskPair x, MaskPair y) { return {hn::Or(x.a, y.a), hn::Or(x.b, y.b)}; }
STEPDIAG_INLINE MaskPair no(MaskPair x) { return {hn::Not(x.a), hn::Not(x.b)}; }
STEPDIAG_INLINE bool is_everywhere(MaskPair x) { return hn::AllTrue(Tag(), hn::And(x.a, x.b)); }
STEPDIAG_INLINE Pair select(MaskPair which, Pair yes, Pair no) {
    return {hn::IfThenElse(which.a, yes.a, no.a), hn::IfThenElse(which.b, yes.b, no.b)};
}
STEPDIAG_INLINE Pair broadcast(Type<Pair>, double value) {
    const Vector all = hn::Set(Tag(), value);
    return {all, all};
}
STEPDIAG_INLINE Pair all(double value) { return broadcast(Type<Pair>(), value); }
STEPDIAG_INLINE Pair none() { return {hn::NaN(Tag()), hn::NaN(Tag())}; }
STEPDIAG_INLINE MaskPair all_true() { return all(0.0) <= all(0.0); }
STEPDIAG_INLINE Pair load(const double* from) {
    return {hn::LoadU(Tag(), from), hn::LoadU(Tag(), from + hn::Lanes(Tag()))};
}
STEPDIAG_INLINE void store(Pair x, double* to) {
    hn::StoreU(x.a, Tag(), to);
    hn::StoreU(x.b, Tag(), to + hn::Lanes(Tag()));
}
STEPDIAG_INLINE void store(MaskPair x, std::uint8_t* to) {
    store(x.a, to);
    store(x.b, to + hn::Lanes(Tag()));
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
