// Which corrections a table makes, as a number: FNV-1a, 64 bit, over chain, volume, tool and every node and value of
// both directions of approach, by their bits. The spelling of the file, the order of its rows and columns,
// uncertainties, method and date leave it as it is.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

std::uint64_t fingerprint(const Chain& chain, const Eigen::Vector3d& volume, const Eigen::Vector3d& tool,
                          const ParameterTable& table);

}  // namespace stepdiag
