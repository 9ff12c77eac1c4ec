// What a head would read if it stood as designed: the constants that its readings are reduced with.
//   head constant   half the optical path over the index, less the mirror's distance, at zero tilt
//   (u, v)          from the change of distance with tilt, d = (L - beta u + alpha v)/(1 - t)
//   psd distance D  from the change of the spot with tilt at two distances, spot = 2 (L + D)/(1 - t) (-beta, alpha)
#pragma once

#include <Eigen/Core>

#include "stepdiag/core/air.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/measurement/head_calibration.hpp"

namespace stepdiag {

// A mirror nearer than this would stand in the head, mm.
double reach(const HeadDesign& design);

struct NominalHead {
    HeadCalibration calibration;
    // Layout psd: unfolded spot = axes (raw - zero), so that a head's detector may be turned as one likes.
    Eigen::Matrix2d spot_axes = Eigen::Matrix2d::Identity();
    Eigen::Vector2d spot_zero = Eigen::Vector2d::Zero();
};

// `distance`: of the mirror, mm. The air is what the readings are reduced with; that of 20 degrees Celsius unless told.
// Throws InvalidArgument where a beam does not meet the mirror, does not come back, or tells nothing of tilts.
NominalHead nominal_head(const HeadDesign& design, double distance, const Environment& environment = {Air{}});

}  // namespace stepdiag
