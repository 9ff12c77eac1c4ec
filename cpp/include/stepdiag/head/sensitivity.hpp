// How a traced head's readings answer to what may be wrong with it: first derivatives by the pose error of every
// component and of the mirror, by the indices of glass and air, by the state of the air. Exact, by forward-mode
// derivatives through the replay of each beam's path; only the slope of the air's index by temperature, pressure and
// humidity is a difference of that equation. Of the beams' axes (chief rays), whatever the
// reading model.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "stepdiag/head/head.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

struct Sensitivity {
    std::string component;    // its name; "mirror", "air", "all interferometers"
    std::string quantity;     // "shift x" ..., "rotation x" ..., "index", "temperature", "pressure", "humidity"
    std::string unit;         // of the quantity: "mm", "rad", "1", "K", "Pa"
    Eigen::VectorXd signals;  // by one unit, in the order of signal_names; mm
    Eigen::Vector3d reading;  // the same reduced to distance (mm), alpha and beta (rad)
};

// In the order of the design's components (bodies, beams, sensors; six degrees of freedom each, then a body's index),
// mirror, air, interferometer (relative index error). Rotations are about the component's own origin, all along the
// head's axes. Throws InvalidArgument for a head without a design, or a mirror pose at which a beam is lost.
std::vector<Sensitivity> head_sensitivities(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size,
                                            const Environment& environment = {Air{}});

}  // namespace stepdiag
