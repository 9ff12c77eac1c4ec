// What deviations of the temperature sensors do to the values of an adjustment. No reading tells them from scale
// errors, so that they are no unknowns, and the weights of the readings stay: their effects are added to the covariance
// ("considered" parameters: S. F. Schmidt, Advances in Control Systems 3 (1966) 293). Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {

// By sensor: change of the unknowns by one standard uncertainty of its deviation, at the last linearisation.
std::vector<Eigen::VectorXd> sensor_effects(const GaussNewton& solver);

// Adds them to the uncertainties and to the covariance, where there is one.
void add_sensor_effects(const std::vector<Eigen::VectorXd>& effects, const AdjustmentProblem& problem,
                        const CalibratedForms& forms, const Observability& observability, Adjustment& result);

}  // namespace stepdiag
