#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace stepdiag {
namespace {

// Sum of random harmonics of one function at its equidistant nodes. `slope` adds a random straight line.
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
    if (!slope) value.back() = 0.0;  // exactly 0 by the choice of frame; sin(pi h) is about 1e-16
    double peak = 0.0;
    for (const double v : value) peak = std::max(peak, std::abs(v));
    if (peak > 0.0)
        for (double& v : value) v *= amplitude / peak;
    return value;
}

}  // namespace

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
