// What encounter-inl.hpp calculates with. A number type N has + - * / > <= and, declared before encounter-inl.hpp is
// included or in N's own namespace:
//   mul_add(a, b, c) = a b + c      sub_mul(a, b, c) = c - a b      root(a)      magnitude(a) = |a|      negative(a) =
//   -a with_sign(a, s) = a >= 0 with the sign of s      both(p, q) of two comparisons      broadcast(Type<N>(), double)
#pragma once

#include <utility>

namespace stepdiag {

template <class N>
struct Type {};

// What a comparison gives: bool, or a mask of lanes.
template <class N>
using Truth = decltype(std::declval<N>() > std::declval<N>());

}  // namespace stepdiag
