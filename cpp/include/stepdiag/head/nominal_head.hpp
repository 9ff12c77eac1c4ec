// Calibration of a head from its nominal design: the constants used to reduce its readings.
//   head constant   half the optical path divided by the index, minus the mirror's distance, at zero tilt
//   (u, v)          from the change of the distance with tilt, d = (L - beta u + alpha v)/(1 - t)
//   psd distance D  from the change of the spot with tilt at two distances, spot = 2 (L + D)/(1 - t) (-beta, alpha)
// Symbols as in measurement/reading.hpp; lengths in mm.
#pragma once

#include <Eigen/Core>

#include "stepdiag/core/air.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/measurement/head_calibration.hpp"

namespace stepdiag {

// Extent of the head beyond its reference plane, mm. The mirror must be farther away.
double reach(const HeadDesign& design);

struct NominalHead {
    HeadCalibration calibration;
    // Layout psd: unfolded spot = spot_axes (raw spot - spot_zero). This allows any orientation of the detector.
    Eigen::Matrix2d spot_axes = Eigen::Matrix2d::Identity();
    Eigen::Vector2d spot_zero = Eigen::Vector2d::Zero();
};

// `distance`: from the reference plane to the mirror, mm. `environment`: the air used to reduce the readings, by
// default at 20 degrees Celsius. Throws InvalidArgument if the distance is within the head, a beam misses the mirror or
// does not return, or the beams do not depend on the tilts.
NominalHead nominal_head(const HeadDesign& design, double distance, const Environment& environment = {Air{}});

}  // namespace stepdiag
