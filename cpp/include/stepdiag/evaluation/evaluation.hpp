// What both published evaluations take and share.
#pragma once

#include <Eigen/Core>

#include "stepdiag/evaluation/calibration.hpp"
#include "stepdiag/evaluation/plausibility.hpp"
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

struct EvaluationOptions {
    ReadingUncertainty uncertainty;
    bool full_covariance = false;  // standard uncertainties are always there
    PlausibleLimits plausible = {};
};

}  // namespace stepdiag
