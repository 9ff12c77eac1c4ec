#include "stepdiag/machine/parameter.hpp"

namespace stepdiag {

std::optional<FunctionId> FunctionId::parse(std::string_view name) {
    if (name.size() != 3 || name[0] != 'E') return std::nullopt;
    const auto component = std::string_view("XYZABC").find(name[1]);
    const auto axis = std::string_view("XYZ").find(name[2]);
    if (component == std::string_view::npos || axis == std::string_view::npos) return std::nullopt;
    return FunctionId{Axis(axis), Component(component)};
}

std::string name(Squareness squareness) {
    return std::array<const char*, 3>{"C0Y", "B0Z", "A0Z"}[static_cast<int>(squareness)];
}

std::optional<Squareness> parse_squareness(std::string_view text) {
    for (const Squareness s : all_squarenesses)
        if (text == name(s)) return s;
    return std::nullopt;
}

}  // namespace stepdiag
