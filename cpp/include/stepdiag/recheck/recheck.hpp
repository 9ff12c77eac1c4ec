// Has the machine changed since its last calibration? A short run answers it, with that calibration and its covariance
// as knowledge: the machine is the calibration plus a change with terms of low order, each known to be 0 with a
// standard uncertainty (its prior) that says how far such a machine may change:
//   scale       E_aa  += c p                      of each axis
//   bow         E_ba  += 4 c (p/T)(1 - p/T)       of each straightness, T the travel, c in its middle
//   slope       E_Ba  += c p/T                    of each rotation, c from end to end
//   squareness  C0Y, B0Z, A0Z += c
// Calibration, change and set-ups of the lines are estimated together, by generalised least squares.
//
// Whether there is a change at all is tested without the priors: along the directions of change that the readings tell
// better than the priors do, which the plan decides and not what was read, the estimates by their covariance are
// chi-square distributed if nothing has changed.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/adjustment/results.hpp"
#include "stepdiag/recheck/verification.hpp"

namespace stepdiag {

enum class ChangeKind { scale, bow, slope, squareness };
std::string name(ChangeKind kind);  // "scale", ...

// Standard uncertainties with which changes are known to be 0; 0: there is none of this kind.
struct ChangePriors {
    double scale = 30e-6;       // mm/mm
    double bow = 5e-3;          // mm
    double slope = 30e-6;       // rad
    double squareness = 50e-6;  // rad
};

// One term of the change, by the parameter that changes.
struct ChangeTerm {
    std::string parameter;  // "EXX", ...
    ChangeKind kind;
    double value;                 // in the unit of its prior
    double standard_uncertainty;  // with the prior
    double prior;
    // How much of it the readings determine, 0 to 1: near 1 by itself; in between only with others, in sums.
    double determined = 0.0;
};

// A sum of changes that the readings determine: weight times change by its prior. The weights have the square sum 1.
struct ChangeCombination {
    std::vector<double> weight;   // by term
    double value;                 // in units of the priors
    double standard_uncertainty;  // of the readings and the calibration alone
};

struct Recheck {
    // Of no change at all.
    double chi_square;
    int degrees_of_freedom;
    double probability;  // of a larger one, if nothing has changed
    // Of all readings: whether a change by these terms, of any size, explains them. What the readings tell of the terms
    // is free here, so that the probability is that of a sound run, of a machine that has changed and of one that has
    // not.
    double fit_chi_square;
    int fit_degrees_of_freedom;
    double fit_probability;
    std::vector<ChangeTerm> terms;
    std::vector<ChangeCombination> combinations;  // the best determined first
    Eigen::MatrixXd covariance;                   // of the terms, with their priors
    Eigen::MatrixXd shape;                        // entry of the calibration x term: by a change of 1
    // The calibration with the change, and the covariance of both together. Its method names the date of the
    // calibration, and it has none of its own; fit and provenance are those of the calibration.
    Calibration updated;
    // Where the readings do not go with the calibration: faults that an adjustment of the run by itself finds, whatever
    // the machine is. All readings that they may have spoilt are left out of everything above.
    std::vector<FaultClass> left_out = {};
    // Where no such change explains the readings: those that are farthest, in units of their uncertainty, from what the
    // machine with the change would read.
    std::vector<PredictedReading> misfits = {};
};

// As verify() (recheck/verification.hpp), which says what counts of `options` and what is refused; and for priors that
// are negative or all 0.
Recheck recheck(const Calibration& baseline, const Measurement& measurement, const Plan& plan, const Chain& chain,
                const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options = {},
                const ChangePriors& priors = {});

// By term, in the unit of its prior: the smallest change, of this term alone, that such readings show with a
// probability of `power` where an unchanged machine is said to have changed with the probability `alpha`; infinite
// where they tell nothing of it. It depends on the plan, the head and the uncertainties of the readings, hardly on what
// was read, so that simulated readings tell it of a plan. Throws InvalidArgument unless 0 < alpha < power < 1.
Eigen::VectorXd smallest_changes_seen(const Recheck& recheck, double alpha = 0.001, double power = 0.95);

}  // namespace stepdiag
