// The verdict of an adjustment's fit. Internal: not installed.
#pragma once

#include "stepdiag/adjustment/adjustment.hpp"

namespace stepdiag {

// From what the adjustment found, its own verdict not counted.
Verdict judge(const Adjustment& adjustment, const Measurement& measurement);

}  // namespace stepdiag
