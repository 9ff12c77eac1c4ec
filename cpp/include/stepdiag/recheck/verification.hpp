// Readings against a calibration that was made without them: the test of a calibration by new readings. Each reading is
// predicted from the calibration, b with covariance C; how head and mirror stood, s, is estimated from the readings, as
// in an adjustment. With the readings' own covariance R and the derivatives J of the predictions f,
//   V = R + J_b C J_b^T,   s^ = (J_s^T V^-1 J_s)^-1 J_s^T V^-1 (y - f(b, s)) by generalised least squares,
//   e = y - f(b, s^),      Cov(e) = V - J_s (J_s^T V^-1 J_s)^-1 J_s^T,
//   chi^2 = e^T V^-1 e,    priors of s being readings of 0.
// E_n = e/U(e) with U = 2 u (ISO 17043): below 1 in 95.4 % of the cases if calibration, readings and uncertainties are
// right.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

// E_n; 0 where the uncertainty is 0: what only tells how head and mirror stood agrees with it.
inline double normalised_deviation(double deviation, double standard_uncertainty) {
    constexpr double coverage_factor = 2.0;
    return standard_uncertainty > 0.0 ? deviation / (coverage_factor * standard_uncertainty) : 0.0;
}

// One reading: by row of the measurement and channel.
struct PredictedReading {
    std::size_t row;
    std::string channel;
    double deviation;             // e: read - predicted, mm or rad
    double standard_uncertainty;  // of the deviation

    double normalised() const { return normalised_deviation(deviation, standard_uncertainty); }
};

// What a line of one run reads too much from its first to its last distance; of beams the mean of those read at both.
struct LineDeviation {
    int run;
    std::string line;
    bool backward;
    double deviation;             // mm
    double standard_uncertainty;  // of the deviation, mm

    double normalised() const { return normalised_deviation(deviation, standard_uncertainty); }
};

struct Verification {
    std::vector<PredictedReading> readings;
    std::vector<LineDeviation> lines;  // as they were measured; none where a line has only one distance
    double chi_square;
    int degrees_of_freedom;
    double probability;  // of a larger chi-square, if all is right; 1 without freedom
    std::size_t worst;   // of `readings`: the largest |E_n|
    // Where the readings do not agree: faults that an adjustment of the run by itself finds, whatever the machine is.
    // All readings that they may have spoilt are left out of everything above.
    std::vector<FaultClass> left_out = {};
};

// By row of a measurement: where a controller's table sent the motors, less the commanded position, mm.
using MotorShifts = std::vector<Eigen::Vector3d>;

// `plan`, `heads` and `options` are those of the readings. Of `options` count: the uncertainties of readings and of
// set-ups, one_setup_per_line, and the expansion of the scales with its uncertainties, which is needed where the
// calibration is referred to a temperature. Throws InvalidArgument as adjust() does; for a calibration without
// covariance, or of another chain, volume or tool; for one that does not determine all 21 parameters; for readings that
// do not tell how head and mirror stood. `sent`, of a run with a compensation in force: the axes stand there; their
// errors are those at the commanded positions, from which they differ by a shift times a slope. Empty: as commanded.
Verification verify(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                    const Chain& chain, const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                    const AdjustmentOptions& options = {}, const MotorShifts& sent = {});

}  // namespace stepdiag
