#pragma once

#include <limits>

namespace stepdiag::test {

inline constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
inline constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace stepdiag::test
