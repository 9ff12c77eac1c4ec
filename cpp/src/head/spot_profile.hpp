// Profile of a Gaussian spot along one axis: shares of its power on intervals, and their derivatives with respect to
// centre and radius.
#pragma once

#include <Eigen/Core>

namespace stepdiag {

// Share of the power between `low` and `high`.
double share_between(double low, double high, double centre, double radius);

// Integral of position times irradiance between `low` and `high`.
double moment_between(double low, double high, double centre, double radius);

// Shares on `count` pixels of width `pitch`. The first pixel starts at `start`.
Eigen::ArrayXd pixel_shares(double centre, double radius, double start, double pitch, int count);

// Columns: share, derivative with respect to the centre, derivative with respect to the radius.
Eigen::ArrayX3d pixel_shares_and_derivatives(double centre, double radius, double start, double pitch, int count);

}  // namespace stepdiag
