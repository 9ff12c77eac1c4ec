// One axis of a Gaussian spot: the share of its power on intervals, and how that changes with centre and radius.
#pragma once

#include <Eigen/Core>

namespace stepdiag {

// Share of the power of a spot at `centre` between `low` and `high`.
double share_between(double low, double high, double centre, double radius);

// Integral of position times irradiance between `low` and `high`.
double moment_between(double low, double high, double centre, double radius);

// Shares on `count` pixels of a pitch, the first of which starts at `start`.
Eigen::ArrayXd pixel_shares(double centre, double radius, double start, double pitch, int count);

// The same with derivatives, in columns: share, by centre, by radius.
Eigen::ArrayX3d pixel_shares_and_derivatives(double centre, double radius, double start, double pitch, int count);

}  // namespace stepdiag
