// What both published evaluations take and share, and what every evaluation knows of the scales' temperatures.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/evaluation/calibration.hpp"
#include "stepdiag/evaluation/plausibility.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/measurement/head_calibration.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

// Standard uncertainty of a reading where the run itself gives none; it weighs the readings and enters the covariance.
struct ReadingUncertainty {
    double distance = 0.1e-3;  // mm; also of d1 ... dn
    double tilt = 1e-6;        // rad
    double spot = 1e-3;        // mm
};

// What is known of the expansion of the scales. With it, an evaluation refers positioning errors to the reference
// temperature, by the temperatures of the run's own channels (measurement/records.hpp).
struct KnownExpansion {
    Expansion expansion;
    Eigen::Vector3d standard_uncertainty = Eigen::Vector3d::Zero();  // of the coefficients, 1/K
    bool one_coefficient = false;                                    // common to the axes, as is its deviation
    double sensor_uncertainty = 0.0;  // standard uncertainty of the constant deviation of each sensor, K
    // Of the scales, where the run says nothing, degrees Celsius; and whether one sensor measured it for all axes.
    std::optional<Eigen::Vector3d> temperature = {};
    bool one_temperature = false;
};

// Throws InvalidArgument as check(Expansion), for uncertainties that are negative or not finite, for coefficients in
// common that are not the same.
void check(const KnownExpansion& known);

// Axes that share an uncertain quantity: each by itself, or all together.
using AxisGroup = std::vector<int>;
std::vector<AxisGroup> axis_groups(bool together);
// Of the coefficients, and of the sensors' deviations.
std::vector<AxisGroup> coefficient_groups(const KnownExpansion& known);
std::vector<AxisGroup> sensor_groups(const Measurement& measurement, const KnownExpansion& known);

// Says in a calibration which temperature it is referred to, or at which it was found.
void state_temperature(const Measurement& measurement, const std::optional<KnownExpansion>& known,
                       Calibration& calibration);

struct EvaluationOptions {
    ReadingUncertainty uncertainty;
    bool full_covariance = false;  // standard uncertainties are always there
    PlausibleLimits plausible = {};
    std::optional<KnownExpansion> expansion = {};
};

}  // namespace stepdiag
