// Adjusts a run and judges the fit: search for faults of readings, exact adjustment with what was done about them,
// tests of the remaining residuals, verdict (docs/conventions.md, "Verdict of a fit").
#pragma once

#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

// Throws InvalidArgument for readings that do not belong to the plan, channels that do not fit the head, a drift that
// is not fixed without what it goes with, options that make no sense, where nothing at all can be determined, or for a
// result that is not plausible.
Adjustment adjust(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                  const HeadCalibrations& heads, const AdjustmentOptions& options = {});

// What a caller found beside the numbers of an adjustment: in words, which adjust() does not make.
struct FoundBeside {
    std::string mistake = {};                          // that would explain the run: the fit is rejected
    std::vector<std::string> implausible_inputs = {};  // that no workshop has: it is doubtful at best
};
// The same adjustment, judged with that: its verdict, and the fit that its calibration carries.
Adjustment judge(Adjustment adjustment, const FoundBeside& beside);

}  // namespace stepdiag
