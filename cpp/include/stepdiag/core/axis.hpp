// The three linear axes of a machine, and the machine frame's directions.
#pragma once

#include <array>

namespace stepdiag {

enum class Axis { X = 0, Y = 1, Z = 2 };

inline constexpr std::array<Axis, 3> all_axes = {Axis::X, Axis::Y, Axis::Z};
inline constexpr int index(Axis axis) { return static_cast<int>(axis); }
inline constexpr char letter(Axis axis) { return "XYZ"[index(axis)]; }

}  // namespace stepdiag
