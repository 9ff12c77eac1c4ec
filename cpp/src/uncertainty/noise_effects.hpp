// What the reading noise of a virtual run does to readings, and through the evaluation's gain to outputs. Internal.
#pragma once

#include <Eigen/Core>
#include <string>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

// d reading / d pose: a row each reading (row of the run * channels + channel), columns: shift x, y, z of the
// functional point (mm), turn about x, y, z of the tool about that point (rad), in the machine frame. By central
// differences of the simulation of a machine with these errors added everywhere. `nominal`: a measurement with the
// run's rows.
Eigen::Matrix<double, Eigen::Dynamic, 6> pose_sensitivity(const VirtualRun& run, const Measurement& nominal);

// Standard deviation of each reading by the noise of the sensors of traced heads (shot and read noise of cameras, noise
// of position devices), from a few simulated runs; empty where no sensor has any.
Eigen::VectorXd sensor_noise(const VirtualRun& run);

class NoiseEffects {
public:
    // `gain`: d output / d reading.
    NoiseEffects(const VirtualCalibrations& calibrations, Eigen::MatrixXd gain);

    // Columns: what each number drawn for a noise does to the outputs, for a number of 1.
    Eigen::MatrixXd of(const ReadingNoise& noise) const;
    const Eigen::MatrixXd& gain() const { return gain_; }

private:
    Eigen::MatrixXd of_distances() const;  // the same length in all distances of a row
    Eigen::MatrixXd of_poses(int column) const;
    void sum_walks(Eigen::MatrixXd& by_row, bool by_setup) const;  // from steps to places

    const VirtualRun& run_;
    const Measurement& nominal_;
    std::vector<std::string> channels_;
    Eigen::MatrixXd gain_;
    Eigen::Matrix<double, Eigen::Dynamic, 6> poses_;  // where some noise displaces them
};

// The group of the budget.
std::string budget_group(const UncertainInput& input);
std::string budget_group(const ReadingNoise& noise);

}  // namespace stepdiag
