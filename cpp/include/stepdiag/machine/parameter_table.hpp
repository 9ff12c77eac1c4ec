// Table of the 21 parameters, and its CSV format, which error maps and calibrations share. The file has leading lines
// "# key=value" and the columns "parameter,position_mm,value,unit,standard_uncertainty". An optional column "direction"
// (+ or -) gives the direction of approach. Values in memory are in native units (mm, rad). Writing and reading a
// number preserves its bits.
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

// Values of one error function at its nodes. An unknown uncertainty is empty. All vectors have the same length.
struct FunctionTable {
    std::vector<double> position;  // mm, ascending
    std::vector<double> value;     // mm or rad
    std::vector<std::optional<double>> standard_uncertainty;
};

// Interpolates linearly between nodes and keeps the end value outside them. `position` in mm.
double interpolate(const FunctionTable& table, double position);

struct SquarenessValue {
    double value;  // rad
    std::optional<double> standard_uncertainty;
};

struct ParameterTable {
    std::map<std::string, std::string> header;  // format, chain, volume_mm, tool_mm, ...
    std::array<std::optional<FunctionTable>, function_count> functions;
    std::array<std::optional<SquarenessValue>, squareness_count> squarenesses;
    // Values at nodes approached in - direction, if the function distinguishes the directions. In that case `functions`
    // has the values for the + direction.
    std::array<std::optional<FunctionTable>, function_count> negative_functions = {};
};

// Valid values of the leading line "# format=...".
inline constexpr const char* error_map_format = "stepdiag error map 1";
inline constexpr const char* calibration_format = "stepdiag calibration 1";

// Key of the leading line of a table that is unverified: at some time a calibration was read whose checksum was absent,
// so that nothing tells whether its values are those that were written. Writers carry the line on, beside a checksum of
// their own.
inline constexpr const char* unverified_key = "unverified";
inline constexpr const char* unverified_because = "a checksum was absent when this calibration was read";

// A calibration (its format says so or, in a file without one, a method) without the leading line "# sha256=" gets the
// key unverified_key in its header. A hand-written error map needs no checksum. Columns may be in any order. Values
// given for one direction only apply to both directions. Throws InvalidArgument, which names file and line, for:
//   - a file that is unreadable, binary or of another format
//   - format, chain, volume_mm or tool_mm given twice
//   - rows that do not have the checksum of the leading line "# sha256=" (a truncated or changed file), or not the
//     number of the line "# rows=" that files of earlier versions have in its place
//   - a missing, unknown or repeated column
//   - an unknown parameter or unit, a text that is not a finite number
//   - positions that do not ascend, a squareness with a position or given twice
//   - a parameter with a direction in some rows only
ParameterTable read_parameter_table(const std::string& path);
ParameterTable parse_parameter_table(std::string_view text, const std::string& file_name);

// Writes to a temporary file beside `path`, then renames it. Throws InvalidArgument for content that could not be read
// back: a header key with "=", a line break in the header, a value that is not finite, a - direction without a +
// direction.
void write_parameter_table(const ParameterTable& table, const std::string& path);
std::string format_parameter_table(const ParameterTable& table);

// Formats three lengths for the leading lines: "800.0 600.0 500.0".
std::string format_lengths(const Eigen::Vector3d& lengths);

}  // namespace stepdiag
