#include "evaluation/batch_map.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

std::unique_ptr<const BatchMap> make_adjustment_batch(const BatchPattern&) {
    throw InvalidArgument("method: expected \"conventional\" or \"enhanced\"");
}

}  // namespace stepdiag
