// Native units of the library: length mm, angle rad, vacuum wavelength nm. A name carries a unit only where it is
// another. And pi.
#pragma once

namespace stepdiag {

inline constexpr double micrometre = 1e-3;   // mm
inline constexpr double microradian = 1e-6;  // rad
inline constexpr double pi = 3.14159265358979323846;

}  // namespace stepdiag
