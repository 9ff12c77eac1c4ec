// How well a run fits, without uncertainties and tests.
#pragma once

#include <optional>

#include "stepdiag/adjustment/options.hpp"

namespace stepdiag {

// How well a run fits and nothing else, in a tenth of an adjustment's time: for comparing many changed copies of a run.
struct FitQuality {
    double weighted_square_sum;  // of residuals and priors
    int degrees_of_freedom;
};
// Without search for faults, tests, uncertainties, cross-validation and plausible limits. At most `most_steps` plain
// steps of Gauss-Newton from zero, and the least square sum on the way: a run that fits is near its minimum after three
// of them and at it after eight; of another one it is no less than that of its minimum, and nobody needs more.
// Nothing where there are no readings or no number comes out. Throws InvalidArgument as adjust does.
std::optional<FitQuality> fit_quality(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options, int most_steps);

}  // namespace stepdiag
