#pragma once

#include "stepdiag/optics/medium.hpp"

namespace stepdiag::test {

inline constexpr Medium glass{1.5168}, air{1.00027};

// Directions and lengths of up to some hundreds of millimetres come from fewer than twenty rounded operations a face.
inline constexpr double direction_rounding = 1e-14, length_rounding = 1e-12;

}  // namespace stepdiag::test
