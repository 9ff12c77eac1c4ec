// Hash of the corrections that a table makes: 64-bit FNV-1a over the bits of chain, volume, tool, and all nodes and
// values of both directions of approach, then of the scales' expansion if the table has one. It does not depend on the
// spelling of the file, the order of its rows and columns, uncertainties, method and date.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

std::uint64_t fingerprint(const Chain& chain, const Eigen::Vector3d& volume, const Eigen::Vector3d& tool,
                          const ParameterTable& table, const std::optional<Expansion>& expansion);

}  // namespace stepdiag
