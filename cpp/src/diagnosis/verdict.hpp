// The verdict of an adjustment's fit. Internal: not installed.
#pragma once

#include "diagnosis/residual_tests.hpp"

namespace stepdiag {

// Reasons where a coefficient of expansion, or a rate of drift, stands too far from what is stated of it.
std::vector<FitReason> far_coefficients(const std::vector<ExpansionEstimate>& expansion,
                                        const std::vector<DriftEstimate>& machine_drift);

// From what the adjustment found, its own verdict not counted, the patterns of its residuals, and the set-up quantities
// that scatter more than their priors. `residual_rounding`: rms of the residuals, each in units of its rounding
// (adjustment/channel_model.hpp). `less_noise`: of residual_tests.hpp.
Verdict judge(const Adjustment& adjustment, const std::vector<ResidualPattern>& patterns,
              const std::vector<ResidualPattern>& prior_scatter, const ResidualPattern& less_noise,
              double residual_rounding);

// AdjustmentOptions::scale_uncertainty, of an adjustment with its verdict.
void scale_uncertainties(Adjustment& adjustment);
// Of a value from its prior, in what lets chance explain: the readings' own uncertainty of it.
double distance_from_prior(double value, double standard_uncertainty, double prior);

// What the treatment of faults costs makes a fit doubtful at best, and comes first.
void take_costs(const std::vector<FitReason>& costs, Verdict& verdict);

// Takes the adjustment's verdict into its calibration: the fit, and the codes of its reasons.
void state_verdict(Adjustment& adjustment);

}  // namespace stepdiag
