// A number type N of text that is compiled for more than one: double and dual numbers (both here), vectors of lanes
// (simd-inl.hpp). N has + - * / > <= and, declared before that text is included or in N's own namespace:
//   mul_add(a, b, c) = a b + c      sub_mul(a, b, c) = c - a b      root(a)      magnitude(a) = |a|
//   negative(a) = -a      with_sign(a, s) = a >= 0 with the sign of s      both(p, q) of two comparisons
//   broadcast(Type<N>(), double)
#pragma once

#include <cmath>
#include <utility>

#include "core/dual.hpp"

// Such text stands in STEPDIAG_NAMESPACE. After Highway that is the namespace of an instruction set: the text is then
// compiled anew for each, hence its guards. Elsewhere, and where there is no Highway, it is plain C++.
#ifdef HWY_NAMESPACE
#define STEPDIAG_BEFORE_NAMESPACE() HWY_BEFORE_NAMESPACE()
#define STEPDIAG_NAMESPACE HWY_NAMESPACE
#define STEPDIAG_AFTER_NAMESPACE() HWY_AFTER_NAMESPACE()
#else
#define STEPDIAG_BEFORE_NAMESPACE() static_assert(true)
#define STEPDIAG_NAMESPACE plain
#define STEPDIAG_AFTER_NAMESPACE() static_assert(true)
#endif

// All of it inlined keeps lanes in registers; under sanitizers that would compile for minutes.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define STEPDIAG_INLINE inline
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define STEPDIAG_INLINE inline
#endif
#ifndef STEPDIAG_INLINE
#define STEPDIAG_INLINE inline __attribute__((always_inline))
#endif

namespace stepdiag {

template <class N>
struct Type {};

// What a comparison gives: bool, or a mask of lanes.
template <class N>
using Truth = decltype(std::declval<N>() > std::declval<N>());

inline bool both(bool p, bool q) { return p && q; }

inline double mul_add(double a, double b, double c) { return a * b + c; }
inline double sub_mul(double a, double b, double c) { return c - a * b; }
inline double root(double a) { return std::sqrt(a); }
inline double negative(double a) { return -a; }
inline double broadcast(Type<double>, double value) { return value; }

inline Dual mul_add(Dual a, Dual b, Dual c) { return a * b + c; }
inline Dual sub_mul(Dual a, Dual b, Dual c) { return c - a * b; }
inline Dual root(Dual a) { return sqrt(a); }
inline Dual magnitude(Dual a) { return abs(a); }
inline Dual negative(Dual a) { return -a; }
inline Dual with_sign(Dual a, Dual sign) { return std::signbit(sign.value) ? -a : a; }
inline Dual broadcast(Type<Dual>, double value) { return {value}; }

}  // namespace stepdiag
