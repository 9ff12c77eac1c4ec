// A number type of code that is compiled for more than one (simd-inl.hpp, optics/number.hpp). N has + - * / > <= and,
// declared before that code is included or in N's own namespace:
//   mul_add(a, b, c) = a b + c      sub_mul(a, b, c) = c - a b      root(a)      magnitude(a) = |a|      negative(a) =
//   -a with_sign(a, s) = a >= 0 with the sign of s      both(p, q) of two comparisons      broadcast(Type<N>(), double)
#pragma once

#include <hwy/base.h>

#include <utility>

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

inline bool both(bool p, bool q) { return p && q; }

}  // namespace stepdiag
