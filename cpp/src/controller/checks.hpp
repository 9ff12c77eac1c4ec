// Checks of a compensator's options and table. Each throws InvalidArgument, which names the option, or the table and
// the key.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

// 100 m. For larger positions, rounding is not small compared with Compensator::inverse_bound.
inline constexpr double farthest_position = 1e5;  // mm

void check(const CompensatorOptions& options);
void check_volume(const Eigen::Vector3d& volume, const CompensatorOptions& options, const std::string& name);
void check_tool(const Eigen::Vector3d& tool, const CompensatorOptions& options, const std::string& name);
// The table's expansion if the options state temperatures.
std::optional<Expansion> check_temperatures(const ParameterTable& table, const CompensatorOptions& options,
                                            const std::string& name);
// Verdict of the table's fit; empty if the table has none.
std::string check_fit(const ParameterTable& table, const CompensatorOptions& options, const std::string& name);
// Whether the table is unverified.
bool check_verified(const ParameterTable& table, const CompensatorOptions& options, const std::string& name);
// Checks that the nodes match the volume. This detects tables in metres or micrometres, or of another machine.
void check_nodes(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name);

// Parameters, slopes and ends of axes that the table does not determine.
std::vector<std::string> not_told(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name);

}  // namespace stepdiag
