// Interface of the number types N of generic numeric code (simd-inl.hpp, optics/number.hpp). N has + - * / > <= and the
// functions below, declared before that code is included or in N's own namespace:
//   mul_add(a, b, c) = a b + c           sub_mul(a, b, c) = c - a b
//   magnitude(a) = |a|                   negative(a) = -a               root(a)
//   with_sign(a, s) = a >= 0 with the sign of s
//   both(p, q) of two comparisons        broadcast(Type<N>(), double)
#pragma once

#include <hwy/base.h>

#include <utility>

// Forced inlining keeps SIMD lanes in registers. Under sanitizers it would take minutes to compile.
#if HWY_IS_ASAN
#define STEPDIAG_INLINE inline
#else
#define STEPDIAG_INLINE HWY_INLINE
#endif

namespace stepdiag {

template <class N>
struct Type {};

// Result type of a comparison: bool, or a mask of SIMD lanes.
template <class N>
using Truth = decltype(std::declval<N>() > std::declval<N>());

inline bool both(bool p, bool q) { return p && q; }

}  // namespace stepdiag
