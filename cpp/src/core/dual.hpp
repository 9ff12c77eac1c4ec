// Dual number: a value and its derivative with respect to one parameter, with
// (a + a' e)(b + b' e) = ab + (a'b + ab') e and e^2 = 0. Calculations with dual numbers give exact derivatives
// (forward-mode automatic differentiation). Comparisons use the values only. Internal: not installed.
#pragma once

#include <cmath>

namespace stepdiag {

struct Dual {
    double value = 0.0;
    double slope = 0.0;
};

inline Dual operator-(Dual a) { return {-a.value, -a.slope}; }
inline Dual operator+(Dual a, Dual b) { return {a.value + b.value, a.slope + b.slope}; }
inline Dual operator-(Dual a, Dual b) { return {a.value - b.value, a.slope - b.slope}; }
inline Dual operator*(Dual a, Dual b) { return {a.value * b.value, a.slope * b.value + a.value * b.slope}; }
inline Dual operator/(Dual a, Dual b) {
    const double quotient = a.value / b.value;
    return {quotient, (a.slope - quotient * b.slope) / b.value};
}
inline Dual sqrt(Dual a) {
    const double root = std::sqrt(a.value);
    return {root, 0.5 * a.slope / root};
}
inline Dual sin(Dual a) { return {std::sin(a.value), std::cos(a.value) * a.slope}; }
inline Dual cos(Dual a) { return {std::cos(a.value), -std::sin(a.value) * a.slope}; }
inline Dual abs(Dual a) { return std::signbit(a.value) ? -a : a; }
inline bool operator>(Dual a, Dual b) { return a.value > b.value; }
inline bool operator<=(Dual a, Dual b) { return a.value <= b.value; }

}  // namespace stepdiag
