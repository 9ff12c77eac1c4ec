// The three linear axes of a machine, the machine frame's directions, and how an axis came to where it stands.
#pragma once

#include <array>

namespace stepdiag {

enum class Axis { X = 0, Y = 1, Z = 2 };

inline constexpr std::array<Axis, 3> all_axes = {Axis::X, Axis::Y, Axis::Z};
inline constexpr int index(Axis axis) { return static_cast<int>(axis); }
inline constexpr char letter(Axis axis) { return "XYZ"[index(axis)]; }

// The direction in which an axis moved last: reversal makes a difference.
enum class Approach { positive = +1, negative = -1 };
using Approaches = std::array<Approach, 3>;  // by axis
inline constexpr Approaches all_positive = {Approach::positive, Approach::positive, Approach::positive};

}  // namespace stepdiag
