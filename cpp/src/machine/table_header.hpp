// What the leading lines "# key=value" of a table say, for all who need more of it than the parameters. Internal: not
// installed. `name` is what messages call the table; each throws InvalidArgument naming it and the key.
#pragma once

#include <Eigen/Core>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

std::vector<std::string> split(std::string_view text, std::string_view separator);

Chain chain_of(const ParameterTable& table, const std::string& name);

// The three lengths of `key`, such as "volume_mm", mm.
Eigen::Vector3d lengths_of(const ParameterTable& table, const std::string& key, const std::string& name);

// The names of error functions that `key` lists, such as "undetermined_slopes"; none where the line is missing.
std::set<std::string> functions_listed(const ParameterTable& table, const std::string& key, const std::string& name);

}  // namespace stepdiag
