#include "controller/checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/vector3.hpp"
#include "core/text_file.hpp"
#include "machine/table_header.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/machine/fit.hpp"

namespace stepdiag {
namespace {

constexpr double shortest_edge = 1e-3;  // mm
constexpr double node_slack = 1e-6;     // mm; accepts rounding of the positions at the ends of a table

constexpr double coldest = -100.0, hottest = 200.0;  // degrees Celsius; detects kelvin

bool is_within(double lowest, double number, double highest) {
    return are_moderate<1>(&number) && lowest <= number && number <= highest;
}

bool states_temperatures(const CompensatorOptions& options) {
    const auto [lowest, highest] = options.temperatures;
    return !(is_within(0.0, lowest, 0.0) && is_within(0.0, highest, 0.0));
}

std::string text(double number) {
    if (are_moderate<1>(&number)) return format_decimal(number, 0);
    if (is_nan(number)) return "nan";  // to print a signalling one raises FE_INVALID
    char characters[32];
    std::snprintf(characters, sizeof characters, "%g", number);
    return characters;
}

void require(bool holds, const std::string& what, const std::string& expected, double got) {
    if (!holds) throw InvalidArgument(what + ": expected " + expected + ", got " + text(got));
}

template <class Call>
void for_each_function(const ParameterTable& table, Call&& call) {
    for (int i = 0; i < function_count; ++i) call(FunctionId::at(i), table.functions[i]);
}

}  // namespace

void check(const CompensatorOptions& options) {
    const auto enumerator = [](const char* what, int value) {
        if (value < 0 || value > 2)
            throw InvalidArgument(std::string(what) + ": expected 0, 1 or 2, got " + std::to_string(value));
    };
    enumerator("outside", int(options.outside));
    enumerator("approach", int(options.approach));
    for (const double origin : options.origin)
        require(is_within(-farthest_position, origin, farthest_position), "origin", "three lengths within 100 m",
                origin);
    require(is_within(0.0, options.margin, farthest_position), "margin", "a length from 0 to 100 m", options.margin);
    if (options.margin > 0.0 && options.outside != Outside::linear)
        throw InvalidArgument("margin: expected 0 unless outside is linear, got " + text(options.margin));
    require(is_within(0.0, options.largest_correction, farthest_position) && options.largest_correction > 0.0,
            "largest_correction", "a positive length of at most 100 m", options.largest_correction);
    require(is_within(0.0, options.largest_tool, farthest_position), "largest_tool", "a length from 0 to 100 m",
            options.largest_tool);
    if (!states_temperatures(options)) return;
    const auto [lowest, highest] = options.temperatures;
    for (const double temperature : options.temperatures)
        require(is_within(coldest, temperature, hottest), "temperatures",
                "two from " + text(coldest) + " to " + text(hottest) + " degrees Celsius", temperature);
    require(lowest < highest, "temperatures", "the lowest below the highest, " + text(highest), lowest);
}

void check_volume(const Eigen::Vector3d& volume, const CompensatorOptions& options, const std::string& name) {
    for (const double edge : volume)
        require(edge >= shortest_edge && edge <= farthest_position, name + ": volume_mm",
                "three edges from " + text(shortest_edge) + " mm to 100 m", edge);
    require(options.margin <= volume.minCoeff(), "margin", "at most the shortest edge of the volume", options.margin);
}

void check_tool(const Eigen::Vector3d& tool, const CompensatorOptions& options, const std::string& name) {
    require(tool.norm() <= options.largest_tool, name + ": tool_mm",
            "a tool no longer than the option largest_tool, " + text(options.largest_tool), tool.norm());
}

std::optional<Expansion> check_temperatures(const ParameterTable& table, const CompensatorOptions& options,
                                            const std::string& name) {
    if (!states_temperatures(options)) return std::nullopt;
    if (auto expansion = expansion_of(table, name)) return expansion;
    const auto header = [&](const char* key) {
        const auto entry = table.header.find(key);
        return entry == table.header.end() ? std::string() : entry->second;
    };
    const std::string found = header("temperature_as_found_c");
    throw InvalidArgument(
        name +
        ": for compensation by temperatures of the scales, expected positioning errors that are referred to a "
        "temperature (temperature_reference_c) by a known expansion (expansion_per_k), got " +
        (!header("temperature_reference_c").empty() ? "no expansion"
         : found.empty()                            ? "neither"
                                                    : "errors as found at " + found + " degrees Celsius") +
        "; evaluate the run again with [temperature] in the scenario");
}

std::string check_fit(const ParameterTable& table, const CompensatorOptions& options, const std::string& name) {
    const std::optional<Fit> fit = fit_of(table.header, name);
    if (fit == Fit::rejected && !options.accept_rejected)
        throw InvalidArgument(name +
                              ": fit=rejected: the readings of this calibration contradict each other or the "
                              "scenario; measure again, or accept it with accept_rejected");
    return fit ? stepdiag::name(*fit) : "";
}

bool check_verified(const ParameterTable& table, const CompensatorOptions& options, const std::string& name) {
    const bool is_unverified = table.header.count(unverified_key) > 0;
    if (is_unverified && !options.accept_unverified)
        throw InvalidArgument(name + ": unverified: " + unverified_because +
                              ": its values may have been changed; evaluate the run again, or accept it with "
                              "accept_unverified");
    return is_unverified;
}

void check_nodes(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name) {
    const auto told = [](const auto& parameter) { return parameter.has_value(); };
    if (std::none_of(table.functions.begin(), table.functions.end(), told) &&
        std::none_of(table.squarenesses.begin(), table.squarenesses.end(), told))
        throw InvalidArgument(name + ": expected at least one of the 21 parameters, got none");
    for_each_function(table, [&](FunctionId id, const std::optional<FunctionTable>& function) {
        if (!function || function->position.empty()) return;  // ErrorMap rejects an empty table
        const double edge = volume[index(id.axis)], first = function->position.front(),
                     last = function->position.back();
        const double inside = std::min(last, edge) - std::max(first, 0.0);
        if (inside < 0.5 * edge || first < -edge || last > 2.0 * edge)
            throw InvalidArgument(name + ": " + id.name() + ": expected nodes over the volume's edge, 0 to " +
                                  text(edge) + " mm, got nodes from " + text(first) + " to " + text(last));
    });
}

std::vector<std::string> not_told(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name) {
    const auto slopes = functions_listed(table, "undetermined_slopes", name);
    const auto constants = functions_listed(table, "undetermined_reversal_constants", name);
    std::vector<std::string> missing;
    for_each_function(table, [&](FunctionId id, const std::optional<FunctionTable>& function) {
        if (!function) return missing.push_back(id.name());
        if (slopes.count(id.name())) missing.push_back(id.name() + " (slope)");
        if (constants.count(id.name())) missing.push_back(id.name() + " (reversal at home)");
        const double first = function->position.front(), last = function->position.back();
        if (first > node_slack) missing.push_back(id.name() + " (below " + text(first) + " mm)");
        if (last < volume[index(id.axis)] - node_slack) missing.push_back(id.name() + " (above " + text(last) + " mm)");
    });
    for (const Squareness s : all_squarenesses)
        if (!table.squarenesses[static_cast<int>(s)]) missing.push_back(stepdiag::name(s));
    return missing;
}

}  // namespace stepdiag
