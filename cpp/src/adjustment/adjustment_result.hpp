// What an adjustment gives back, from its unknowns and their covariance. Internal: not installed.
#pragma once

#include "adjustment/adjustment_tables.hpp"
#include "adjustment/gauss_newton.hpp"
#include "adjustment/observability.hpp"
#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

// The forms that a calibration's tables are made of: what is determined, as itself or as its shape.
struct CalibratedForms {
    std::array<std::optional<FunctionForms>, function_count> functions;
    std::array<bool, function_count> slope_determined;
    std::array<std::optional<LinearForm>, squareness_count> squarenesses;

    std::vector<const LinearForm*> in_order() const;  // that of Calibration::covariance
};
CalibratedForms choose_forms(const AdjustmentTables& tables);

Calibration make_calibration(const AdjustmentProblem& problem, const AdjustmentTables& tables,
                             const CalibratedForms& forms, const Eigen::VectorXd& x, const BorderedBand& inverse);
// The full covariance of the values of a calibration: correlations by solutions with the factor, standard uncertainties
// those of the calibration. These come from the selected inverse, whose recurrence loses more digits where a set-up
// is open: 4e-5 of a variance, 2e-8 with solutions, where distances are known to 1 nm and a laser's angle to 2 mrad.
void add_covariance(const AdjustmentProblem& problem, const CalibratedForms& forms, const BorderedFactor& factor,
                    Calibration& calibration);
// `determined`, less the unknowns of set-ups of which the readings tell hardly more than that "free" has its limits.
std::vector<bool> known_unknowns(const AdjustmentProblem& problem, std::vector<bool> determined,
                                 const BorderedBand& inverse);
std::vector<SetupEstimate> setup_estimates(const AdjustmentProblem& problem, const std::vector<bool>& known,
                                           const Eigen::VectorXd& x, const BorderedBand& inverse);
std::vector<ExpansionEstimate> expansion_estimates(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                                   const BorderedBand& inverse);
std::vector<DriftEstimate> drift_estimates(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                           const BorderedBand& inverse);
// Of readings, priors and smoothness over unknowns.
int degrees_of_freedom(const GaussNewton& solver);
// Of all readings in the problem's order, at the last linearisation.
std::vector<ReadingResidual> reading_residuals(const NormalEquations& equations, const Eigen::VectorXd& variances);

}  // namespace stepdiag
