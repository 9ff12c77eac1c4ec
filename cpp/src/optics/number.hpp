// What encounter-inl.hpp calculates with. A number type N has + - * / > <= and, declared before encounter-inl.hpp is
// included or in N's own namespace:
//   mul_add(a, b, c) = a b + c      sub_mul(a, b, c) = c - a b      root(a)      magnitude(a) = |a|      negative(a) =
//   -a with_sign(a, s) = a >= 0 with the sign of s      both(p, q) of two comparisons      broadcast(Type<N>(), double)
#pragma once

#include <hwy/base.h>

#include <utility>

#include "stepdiag/optics/dual.hpp"

// All of it inlined keeps lanes in registers; under sanitizers that would compile for minutes.
#if HWY_IS_ASAN
#define STEPDIAG_INLINE inline
#else
#define STEPDIAG_INLINE HWY_INLINE
#endif

namespace stepdiag {

template <class N>
struct Type {};

// What a comparison gives: bool, or a mask of lanes.
template <class N>
using Truth = decltype(std::declval<N>() > std::declval<N>());

inline Dual mul_add(Dual a, Dual b, Dual c) { return a * b + c; }
inline Dual sub_mul(Dual a, Dual b, Dual c) { return c - a * b; }
inline Dual root(Dual a) { return sqrt(a); }
inline Dual magnitude(Dual a) { return abs(a); }
inline Dual negative(Dual a) { return -a; }
inline Dual with_sign(Dual a, Dual sign) { return std::signbit(sign.value) ? -a : a; }
inline bool both(bool p, bool q) { return p && q; }
inline Dual broadcast(Type<Dual>, double value) { return {value}; }

}  // namespace stepdiag
