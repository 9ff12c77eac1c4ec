// Reads values from the leading lines "# key=value" of a table. A missing or invalid line throws InvalidArgument; the
// message names the key, and the table by `name`. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

std::vector<std::string> split(std::string_view text, std::string_view separator);

Chain chain_of(const ParameterTable& table, const std::string& name);

// Three lengths, mm, such as those of the key "volume_mm".
Eigen::Vector3d lengths_of(const ParameterTable& table, const std::string& key, const std::string& name);

// The expansion of the keys temperature_reference_c, expansion_per_k and, if it is there, fixed_point_mm; none without
// expansion_per_k.
std::optional<Expansion> expansion_of(const ParameterTable& table, const std::string& name);

// Names of error functions, such as those of the key "undetermined_slopes"; empty if the line is missing.
std::set<std::string> functions_listed(const ParameterTable& table, const std::string& key, const std::string& name);

}  // namespace stepdiag
