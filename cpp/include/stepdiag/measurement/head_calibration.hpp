// What evaluators know of a head: the constants that its readings are reduced with, and nothing of its errors.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace stepdiag {

struct HeadCalibration {
    std::optional<double> psd_distance;  // unfolded plane of the position sensing device behind the reference plane, mm
    std::vector<Eigen::Vector2d> beam_offsets;  // (u, v) of the beams d1 ... dn in the sensor frame, mm
};

}  // namespace stepdiag
