// What a compensator refuses to be made of. Each throws InvalidArgument naming the option, or the table and its key.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

// 100 m: beyond it rounding alone is no longer small beside Compensator::inverse_bound.
inline constexpr double farthest_position = 1e5;  // mm

void check(const CompensatorOptions& options);
void check_volume(const Eigen::Vector3d& volume, const CompensatorOptions& options, const std::string& name);
void check_tool(const Eigen::Vector3d& tool, const CompensatorOptions& options, const std::string& name);
// The verdict of the table's fit; empty where it has none.
std::string check_fit(const ParameterTable& table, const CompensatorOptions& options, const std::string& name);
// Whether the nodes can be those of the volume: a table in metres or micrometres, or of another machine, is not.
void check_nodes(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name);

// Parameters, slopes and ends of axes that the table does not tell.
std::vector<std::string> not_told(const ParameterTable& table, const Eigen::Vector3d& volume, const std::string& name);

}  // namespace stepdiag
