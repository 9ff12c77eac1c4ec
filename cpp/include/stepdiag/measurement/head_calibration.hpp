// What evaluators know of a head: the constants that its readings are reduced with, and nothing of its errors.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace stepdiag {

struct HeadCalibration {
    double psd_distance = 0.0;                 // unfolded plane of the position sensing device behind the reference plane, mm
    std::vector<Eigen::Vector2d> beam_offsets; // (u, v) of the beams d1 ... dn in the sensor frame, mm
};

}  // namespace stepdiag
