// Errors of a machine over a box of commanded positions, by its exact pose (machine/machine.hpp), axes approached in +
// direction:
//   e(p) = actual minus nominal functional point, mm
//   tilt(p) = rotation vector of the tool's actual orientation (nominal: none), rad
// in the machine frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "stepdiag/evaluation/calibration.hpp"
#include "stepdiag/machine/machine.hpp"

namespace stepdiag {

// Ascending positions of the axes X, Y, Z, mm. A grid has all their combinations.
using GridPositions = std::array<std::vector<double>, 3>;

struct VolumeSummary {
    double largest = 0.0;                       // |e|, mm
    Eigen::Vector3d largest_at, components;     // where, and e there, mm
    double rms = 0.0;                           // root of the mean of |e|^2 over the box by the trapezoidal rule, mm
    Eigen::Vector3d lowest, highest;            // of the components of e, mm
    Eigen::Vector3d tilt_lowest, tilt_highest;  // of the components of the tilt, rad
};
// Throws InvalidArgument for an axis without positions, positions that are not finite or do not ascend.
void check_grid(const GridPositions& grid);
// Of the trapezoidal rule over ascending positions; they sum to 1.
std::vector<double> trapezoidal_weights(const std::vector<double>& positions);
// `tilts`: whether to compute them, which takes most of the time. Throws InvalidArgument as check_grid.
VolumeSummary summarise_volume(const Machine& machine, const GridPositions& grid, bool tilts = true);

// The machine with these parameters (indices of Term: functions, then squarenesses) set to 0.
Machine without_parameters(const Machine& machine, const std::vector<int>& parameters);

// e and tilt as rows: (n, 6), mm and rad.
using SixRows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
using PointRows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
SixRows errors_at(const Machine& machine, const PointRows& points);

// Standard uncertainties of the same, (n, 6), from the covariance of a calibration; linear in its values. Throws
// InvalidArgument for a calibration without covariance. What a missing parameter acts in is NaN.
SixRows error_uncertainties_at(const Calibration& calibration, const Eigen::Vector3d& tool, const PointRows& points);
// How the same change with the values of a calibration, to first order: (6 n, k), mm and rad, six rows a point, for
// changes of all its entries (entries, k) in the order of the covariance. What a missing parameter acts in is NaN.
// Throws InvalidArgument for another number of entries.
Eigen::MatrixXd error_changes_at(const Calibration& calibration, const Eigen::Vector3d& tool, const PointRows& points,
                                 const Eigen::MatrixXd& changes);

}  // namespace stepdiag
