// What is said of the faults of an adjustment. Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_result.hpp"
#include "diagnosis/fault_search.hpp"

namespace stepdiag {

// `forms`: of which what the alternatives of a class make of them is compared.
std::vector<FaultClass> said_faults(const FaultContext& context, const FaultState& state, const CalibratedForms& forms,
                                    const Measurement& measurement);

}  // namespace stepdiag
