// Adjusts many sets of readings: each until it converges, or by one step from the pattern's solution. Internal.
#pragma once

#include "batch/batch_method.hpp"

namespace stepdiag {

std::unique_ptr<const BatchMethod> make_adjustment_batch(const BatchPattern& pattern);

}  // namespace stepdiag
