#include "stepdiag/machine/error_map.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/core/units.hpp"

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

// Random harmonics of one function at its equidistant nodes; `slope` adds a random straight line.
std::vector<double> random_shape(std::uint64_t seed, int function, int intervals, bool slope, double amplitude) {
    constexpr int harmonics = 5;
    std::vector<double> value(intervals + 1, 0.0);
    for (int h = 0; h <= harmonics; ++h) {
        const double weight = normal_pair(seed, RandomStream::error_map, std::uint64_t(function) * 64 + h)[0] / (h + 1);
        for (int i = 0; i <= intervals; ++i) {
            const double x = double(i) / intervals;
            if (h > 0) value[i] += weight * std::sin(pi * h * x);
            else if (slope) value[i] += weight * x;
        }
    }
    if (!slope) value.back() = 0.0;  // sin(pi h) is 1e-16, the frame choice says 0
    double peak = 0.0;
    for (const double v : value) peak = std::max(peak, std::abs(v));
    if (peak > 0.0)
        for (double& v : value) v *= amplitude / peak;
    return value;
}

}  // namespace

ErrorMap::ErrorMap(ParameterTable table) : table_(std::move(table)) {
    for (int i = 0; i < function_count; ++i) {
        const std::string name = FunctionId::at(i).name();
        const auto& negative = table_.negative_functions[i];
        if (table_.functions[i]) check_function(*table_.functions[i], name);
        if (!negative) continue;
        if (!table_.functions[i])
            throw InvalidArgument(name + ": has a table of the - direction, and none of the + direction");
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

std::vector<std::string> ErrorMap::warnings(const Eigen::Vector3d& volume) const {
    if (!volume.allFinite()) throw InvalidArgument("volume: expected three finite edges in mm");
    std::vector<std::string> sentences;
    for (int i = 0; i < function_count; ++i) {
        if (!table_.functions[i]) continue;
        const FunctionId id = FunctionId::at(i);
        const double peak =
            Eigen::Map<const Eigen::VectorXd>(table_.functions[i]->value.data(), table_.functions[i]->value.size())
                .cwiseAbs()
                .maxCoeff();
        const double tolerance = 1e-9 * peak;  // a table rounded to nine digits still counts as zero there
        const auto report = [&](double position, const char* where) {
            if (std::abs(function(id, position)) <= tolerance) return;
            std::ostringstream text;
            text << id.name() << " is " << function(id, position) / (id.is_rotation() ? microradian : micrometre)
                 << (id.is_rotation() ? " urad " : " um ") << where << ", where the frame choice has 0; used as given";
            sentences.push_back(text.str());
        };
        report(0.0, "at home");
        if (id.is_straightness()) report(volume[index(id.axis)], "at the end of travel");
    }
    return sentences;
}

ErrorMap read_error_map(const std::string& path) { return ErrorMap(read_parameter_table(path)); }

ErrorMap make_random_error_map(const Eigen::Vector3d& volume, const RandomErrorMap& options) {
    const auto require = [](bool ok, const std::string& what) {
        if (!ok) throw InvalidArgument("random error map: " + what);
    };
    require(volume.allFinite() && volume.minCoeff() > 0.0, "volume: expected three positive lengths in mm");
    require(options.intervals >= 2 && options.intervals <= 1'000'000,
            "intervals: expected 2 to 1000000, got " + std::to_string(options.intervals));
    for (const auto& [key, value] :
         {std::pair("translation", options.translation), std::pair("rotation", options.rotation),
          std::pair("squareness", options.squareness), std::pair("screw_pitch", options.screw_pitch),
          std::pair("screw_amplitude", options.screw_amplitude)})
        require(std::isfinite(value) && value >= 0.0, std::string(key) + ": expected a finite value of at least 0");
    require(options.screw_amplitude == 0.0 || options.screw_pitch > 0.0,
            "screw_pitch: expected a positive length in mm with a screw_amplitude");

    ParameterTable table;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        FunctionTable function;
        for (int k = 0; k <= options.intervals; ++k)
            function.position.push_back(k * volume[index(id.axis)] / options.intervals);
        function.value = random_shape(options.seed, i, options.intervals, !id.is_straightness(),
                                      id.is_rotation() ? options.rotation : options.translation);
        if (id.is_positioning() && options.screw_amplitude > 0.0)
            for (int k = 0; k <= options.intervals; ++k)
                function.value[k] +=
                    options.screw_amplitude * std::sin(2.0 * pi * function.position[k] / options.screw_pitch);
        function.standard_uncertainty.resize(function.position.size());
        table.functions[i] = std::move(function);
    }
    for (const Squareness s : all_squarenesses) {
        const double unit = uniform_pair(options.seed, RandomStream::error_map, 1'000'000 + std::uint64_t(s))[0];
        table.squarenesses[static_cast<int>(s)] =
            SquarenessValue{(2.0 * unit - 1.0) * options.squareness, std::nullopt};
    }
    return ErrorMap(std::move(table));
}

}  // namespace stepdiag
