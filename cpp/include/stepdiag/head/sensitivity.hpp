// Sensitivity of a traced head's readings: first derivatives with respect to the pose error of every component and of
// the mirror, the indices of glass and air, and the state of the air. The derivatives are exact (forward-mode
// differentiation of the replay of each beam's path). Only the derivative of the air's index with respect to
// temperature, pressure and humidity is a finite difference. The derivatives are those of the beams' axes (chief rays)
// for either reading model.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "stepdiag/head/head.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

struct Sensitivity {
    std::string component;    // name of the component; "mirror", "air", "all interferometers"
    std::string quantity;     // "shift x" ..., "rotation x" ..., "index", "temperature", "pressure", "humidity"
    std::string unit;         // of the quantity: "mm", "rad", "1", "K", "Pa"
    Eigen::VectorXd signals;  // change of the signals per unit of the quantity, mm, in the order of signal_names
    Eigen::Vector3d reading;  // change of the reduced distance (mm), alpha and beta (rad) per unit
};

// Order: the design's components (bodies, beams, sensors; for each the six degrees of freedom, then the index of a
// body), mirror, air, interferometers (relative index error). Rotations are about the component's own origin; all
// directions are the head's axes. `mirror`: pose in the sensor frame; `size`: width and height of the mirror, mm.
// Throws InvalidArgument for a head without a design, and for a mirror pose at which a beam is lost.
std::vector<Sensitivity> head_sensitivities(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size,
                                            const Environment& environment = {Air{}});

}  // namespace stepdiag
