// Dual numbers as a number type of encounter-inl.hpp.
#pragma once

#include "core/number.hpp"
#include "stepdiag/optics/dual.hpp"

namespace stepdiag {

inline Dual mul_add(Dual a, Dual b, Dual c) { return a * b + c; }
inline Dual sub_mul(Dual a, Dual b, Dual c) { return c - a * b; }
inline Dual root(Dual a) { return sqrt(a); }
inline Dual magnitude(Dual a) { return abs(a); }
inline Dual negative(Dual a) { return -a; }
inline Dual with_sign(Dual a, Dual sign) { return std::signbit(sign.value) ? -a : a; }
inline Dual broadcast(Type<Dual>, double value) { return {value}; }

}  // namespace stepdiag
