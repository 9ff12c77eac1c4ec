#include "stepdiag/machine/error_map.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

void check_function(const FunctionTable& table, const std::string& name) {
    const auto size = table.position.size();
    if (size == 0 || table.value.size() != size || table.standard_uncertainty.size() != size)
        throw InvalidArgument(name + ": expected as many values and uncertainties as positions, and at least one");
    for (std::size_t i = 0; i < size; ++i) {
        if (!std::isfinite(table.position[i]) || !std::isfinite(table.value[i]))
            throw InvalidArgument(name + ": position and value of node " + std::to_string(i) + " must be finite");
        if (const auto& u = table.standard_uncertainty[i]; u && !(std::isfinite(*u) && *u >= 0.0))
            throw InvalidArgument(name + ": standard uncertainty of node " + std::to_string(i) +
                                  " must be finite and at least 0");
        if (i > 0 && !(table.position[i] > table.position[i - 1]))
            throw InvalidArgument(name + ": positions must ascend, but node " + std::to_string(i) + " does not");
    }
}

}  // namespace

ErrorMap::ErrorMap(ParameterTable table) : table_(std::move(table)) {
    for (int i = 0; i < function_count; ++i) {
        const std::string name = FunctionId::at(i).name();
        const auto& negative = table_.negative_functions[i];
        if (table_.functions[i]) check_function(*table_.functions[i], name);
        if (!negative) continue;
        if (!table_.functions[i])
            throw InvalidArgument(name + ": has a table of the - direction but none of the + direction");
        check_function(*negative, name + " in - direction");
    }
    for (const Squareness s : all_squarenesses)
        if (!std::isfinite(squareness(s))) throw InvalidArgument(name(s) + ": must be finite");
}

double ErrorMap::function(FunctionId id, double position, Approach approach) const {
    const auto& negative = table_.negative_functions[id.index()];
    const auto& table = approach == Approach::negative && negative ? negative : table_.functions[id.index()];
    return table ? interpolate(*table, position) : 0.0;
}

double ErrorMap::squareness(Squareness squareness) const {
    const auto& entry = table_.squarenesses[static_cast<int>(squareness)];
    return entry ? entry->value : 0.0;
}

Eigen::Vector3d ErrorMap::delta(Axis axis, double position, Approach approach) const {
    Eigen::Vector3d delta;
    for (int c = 0; c < 3; ++c) delta[c] = function({axis, Component(c)}, position, approach);
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        if (term.axis == axis) delta[term.component] += term.sign * squareness(s) * position;
    }
    return delta;
}

Eigen::Vector3d ErrorMap::theta(Axis axis, double position, Approach approach) const {
    Eigen::Vector3d theta;
    for (int c = 0; c < 3; ++c) theta[c] = function({axis, Component(c + 3)}, position, approach);
    return theta;
}

std::vector<FrameDeviation> ErrorMap::frame_deviations(const Eigen::Vector3d& volume) const {
    if (!volume.allFinite()) throw InvalidArgument("volume: expected three finite edges in mm");
    std::vector<FrameDeviation> deviations;
    for (int i = 0; i < function_count; ++i) {
        if (!table_.functions[i]) continue;
        const FunctionId id = FunctionId::at(i);
        const double peak =
            Eigen::Map<const Eigen::VectorXd>(table_.functions[i]->value.data(), table_.functions[i]->value.size())
                .cwiseAbs()
                .maxCoeff();
        const double tolerance = 1e-9 * peak;  // accepts tables rounded to nine digits
        const auto note = [&](double position) {
            const double value = function(id, position);
            if (std::abs(value) > tolerance) deviations.push_back({id, position, value});
        };
        note(0.0);
        if (id.is_straightness()) note(volume[index(id.axis)]);
    }
    return deviations;
}

ErrorMap read_error_map(const std::string& path) { return ErrorMap(read_parameter_table(path)); }

}  // namespace stepdiag
