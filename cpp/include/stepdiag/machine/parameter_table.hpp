// The CSV format that error maps and calibrations share: "parameter,position_mm,value,unit,standard_uncertainty" behind
// leading "# key=value" lines; optional column "direction" (+ or -, for reversal). Values are kept in native units (mm,
// rad), and a number written is read back to the same bits.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/machine/parameter.hpp"

namespace stepdiag {

// One error function at its nodes; an uncertainty that is not known is absent.
struct FunctionTable {
    std::vector<double> position;  // mm, ascending
    std::vector<double> value;     // mm or rad
    std::vector<std::optional<double>> standard_uncertainty;
};

// Linear between nodes; outside them the end value.
double interpolate(const FunctionTable& table, double position);

struct SquarenessValue {
    double value;  // rad
    std::optional<double> standard_uncertainty;
};

struct ParameterTable {
    std::map<std::string, std::string> header;  // format, chain, volume_mm, tool_mm, ...
    std::array<std::optional<FunctionTable>, function_count> functions;
    std::array<std::optional<SquarenessValue>, squareness_count> squarenesses;
    // Of nodes approached in - direction, where these have a table of their own; `functions` then has that of the +
    // direction.
    std::array<std::optional<FunctionTable>, function_count> negative_functions = {};
};

// What the leading line "# format=..." of a table may say.
inline constexpr const char* error_map_format = "stepdiag error map 1";
inline constexpr const char* calibration_format = "stepdiag calibration 1";

// Columns may stand in any order. Throws InvalidArgument naming file and line: unreadable or binary file, another
// format; format, chain, volume_mm or tool_mm given twice; rows that the leading line "# rows=" does not count, as of a
// file that was cut; a column missing, unknown or doubled, unknown parameter or unit, a number that is none or not
// finite, positions that do not ascend, a squareness with a position or given twice, a parameter of which some rows
// have a direction and some have none. What is given for one direction alone is taken for both.
ParameterTable read_parameter_table(const std::string& path);
ParameterTable parse_parameter_table(std::string_view text, const std::string& file_name);

// Writes to a temporary file beside `path`, then renames it. Throws InvalidArgument for what could not be read back: a
// header key with "=", a line break in the header, a value that is not finite, a - direction without the other.
void write_parameter_table(const ParameterTable& table, const std::string& path);
std::string format_parameter_table(const ParameterTable& table);

// Three lengths of the leading lines, "800.0 600.0 500.0".
std::string format_lengths(const Eigen::Vector3d& lengths);

}  // namespace stepdiag
