// Names of the 21 geometric error parameters (ISO 230-1). There are 18 error functions E<component><axis> with the
// components X Y Z (translations, mm) and A B C (rotations about X Y Z, rad), and the squarenesses C0Y, B0Z, A0Z (rad).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "stepdiag/core/axis.hpp"

namespace stepdiag {

enum class Component { X = 0, Y = 1, Z = 2, A = 3, B = 4, C = 5 };
enum class Squareness { C0Y = 0, B0Z = 1, A0Z = 2 };

inline constexpr int function_count = 18;
inline constexpr int squareness_count = 3;
inline constexpr std::array<Squareness, 3> all_squarenesses = {Squareness::C0Y, Squareness::B0Z, Squareness::A0Z};

// Error function of one component of one axis. index() is its place in tables of 18 functions, ordered by axis.
struct FunctionId {
    Axis axis;
    Component component;

    constexpr int index() const { return 6 * stepdiag::index(axis) + static_cast<int>(component); }
    constexpr bool is_rotation() const { return component >= Component::A; }
    constexpr bool is_positioning() const { return static_cast<int>(component) == stepdiag::index(axis); }
    constexpr bool is_straightness() const { return !is_rotation() && !is_positioning(); }
    std::string name() const { return {'E', "XYZABC"[static_cast<int>(component)], letter(axis)}; }

    static constexpr FunctionId at(int index) { return {Axis(index / 6), Component(index % 6)}; }
    static std::optional<FunctionId> parse(std::string_view name);  // "EXX" ... "ECZ"
};

std::string name(Squareness squareness);
std::optional<Squareness> parse_squareness(std::string_view text);

// How a squareness enters the translations: the axis, the component of its translation (0 to 2 for x, y, z), and the
// sign.
// delta_Y.x = EXY - C0Y y, delta_Z.x = EXZ + B0Z z, delta_Z.y = EYZ - A0Z z.
struct SquarenessTerm {
    Axis axis;
    int component;
    double sign;
};
inline constexpr SquarenessTerm squareness_term(Squareness squareness) {
    switch (squareness) {
        case Squareness::C0Y: return {Axis::Y, 0, -1.0};
        case Squareness::B0Z: return {Axis::Z, 0, +1.0};
        default: return {Axis::Z, 1, -1.0};
    }
}

}  // namespace stepdiag
