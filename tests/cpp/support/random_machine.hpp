// Random machines for tests of the compensator.
#pragma once

#include <Eigen/Core>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/machine/machine.hpp"

namespace stepdiag {

using Position = std::array<double, 3>;

inline const Eigen::Vector3d test_volume(800.0, 600.0, 500.0), test_tool(5.0, -3.0, 80.0);
inline const std::string test_chain = "[w X' b Y Z t]";

inline Eigen::Vector3d vector(const Position& p) { return {p[0], p[1], p[2]}; }
inline Position position(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline double distance(const Position& a, const Position& b) { return (vector(a) - vector(b)).norm(); }

// The machine adds up positions of 1,000 mm, each rounded to 1e-13 mm; the compensator adds up errors.
inline constexpr double machine_rounding = 2e-12;  // mm

inline ParameterTable with_header(ParameterTable table, const std::string& chain = test_chain,
                                  const Eigen::Vector3d& volume = test_volume) {
    table.header = {{"chain", chain}, {"volume_mm", format_lengths(volume)}, {"tool_mm", format_lengths(test_tool)}};
    return table;
}

inline ParameterTable random_table(int intervals = 50, const std::string& chain = test_chain, std::uint64_t seed = 1) {
    RandomErrorMap options;
    options.seed = seed;
    options.intervals = intervals;
    return with_header(make_random_error_map(test_volume, options).table(), chain);
}

// The table with scales of steel, aluminium and Zerodur, fixed somewhere; its errors are referred to 20 degrees
// Celsius.
inline const Expansion test_expansion = {{11.5e-6, 23.8e-6, -0.05e-6}, {150.0, -40.0, 500.0}, 20.0};
inline ParameterTable expanding(ParameterTable table) {
    table.header["temperature_reference_c"] = "20.0";
    table.header["expansion_per_k"] = "1.15e-05 2.38e-05 -5e-08";
    table.header["fixed_point_mm"] = "150 -40 500";
    return table;
}

// Random positions from -outside to volume + outside, mm.
inline std::vector<Position> random_positions(int count, double outside = 0.0, unsigned seed = 1) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Position> positions;
    for (int i = 0; i < count; ++i) {
        Position p;
        for (int a = 0; a < 3; ++a) p[a] = unit(engine) * (test_volume[a] + 2.0 * outside) - outside;
        positions.push_back(p);
    }
    return positions;
}

inline std::vector<std::string> all_chains() {
    std::vector<std::string> chains;
    for (std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"})
        for (int before_bed = 0; before_bed <= 3; ++before_bed) {
            std::string text = "w";
            for (int i = 0; i < 3; ++i) {
                if (i == before_bed) text += "b";
                text += order[i];
                if (i < before_bed) text += "'";
            }
            chains.push_back(text + (before_bed == 3 ? "bt" : "t"));
        }
    return chains;
}

}  // namespace stepdiag
