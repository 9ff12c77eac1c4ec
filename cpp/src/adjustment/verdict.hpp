// The verdict of an adjustment's fit. Internal: not installed.
#pragma once

#include "adjustment/residual_tests.hpp"

namespace stepdiag {

// From what the adjustment found, its own verdict not counted, and the patterns of its residuals.
Verdict judge(const Adjustment& adjustment, const std::vector<ResidualPattern>& patterns);

// AdjustmentOptions::scale_uncertainty, of an adjustment with its verdict.
void scale_uncertainties(Adjustment& adjustment);

}  // namespace stepdiag
