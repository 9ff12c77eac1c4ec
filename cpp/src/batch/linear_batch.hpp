// The published evaluations, conventional and enhanced, of many sets of readings, by one linear map of the pattern.
// Internal.
#pragma once

#include "batch/batch_method.hpp"

namespace stepdiag {

std::unique_ptr<const BatchMethod> make_linear_batch(const BatchPattern& pattern);

}  // namespace stepdiag
