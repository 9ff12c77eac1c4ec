// The class of a fault: what it may be instead. Internal: not installed.
// All hypotheses whose gain is less than 25 behind that of the best, on the problem linearised at the solution, and by
// exact adjustments of the best 20 where the fault is so large that second order may tell.
#pragma once

#include <optional>

#include "diagnosis/found_faults.hpp"

namespace stepdiag {

// Of one more fault beside these, were it the only one that is not known, and how it is handled; none where it is not
// significant. `solution`: with all of them, near which the others alone are linearised.
std::optional<FoundFault> class_of_one_more(const FaultContext& context, const FoundFaults& others,
                                            const Solution& solution);

}  // namespace stepdiag
