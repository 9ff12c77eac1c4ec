// What deviations that no reading tells do to the values of an adjustment: those of the temperature sensors, and those
// of the instrument's scale and of its sensors of the air. Readings do not tell them from scale errors of the machine,
// so that they are no unknowns, and the weights of the readings stay: their effects are added to the covariance
// ("considered" parameters: S. F. Schmidt, Advances in Control Systems 3 (1966) 293). Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {

// Change of the unknowns by one standard uncertainty of a deviation, at the last linearisation.
struct DeviationEffect {
    UncertaintySource source;
    bool is_unknown;  // its prior counts in the uncertainties already
    Eigen::VectorXd of_unknowns;
};

// Of the temperature sensors, the scales' coefficients (which are unknowns), the instrument's scale and the air.
std::vector<DeviationEffect> deviation_effects(const GaussNewton& solver, const AdjustmentOptions& options);

// Adds them to the uncertainties and to the covariance, where there is one, and says how large the part of each source
// is.
void add_deviation_effects(const std::vector<DeviationEffect>& effects, const AdjustmentProblem& problem,
                           const CalibratedForms& forms, const Observability& observability, Adjustment& result);

}  // namespace stepdiag
