// Calibration of a head: the constants with which evaluations reduce its readings. The errors of the head are not known
// to evaluations. Lengths in mm, sensor frame.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stepdiag {

struct HeadCalibration {
    // Layout psd: distance of the position sensing device's unfolded plane behind the reference plane, mm. It is a
    // reduced length: glass of thickness t counts as t n_air/n.
    std::optional<double> psd_distance = {};
    // Layout multi_beam: offsets (u, v) of the beams d1 ... dn in the reference plane, mm.
    std::vector<Eigen::Vector2d> beam_offsets = {};
    // Layout psd: offset (u, v) of the beam that makes the spot, mm.
    Eigen::Vector2d spot_beam = Eigen::Vector2d::Zero();
    // Contribution of windows and splitters to each distance of a nominal head, mm. Readings are already corrected for
    // it.
    std::vector<double> head_constants = {};
    // Distance from the beam's origin to the line's first commanded functional point, mm.
    double standoff = 100.0;
};

// Calibrations of the heads on all lines.
struct HeadCalibrations {
    HeadCalibration head;
    std::map<std::string, HeadCalibration> by_line;  // exceptions, by the name of the line

    HeadCalibrations(HeadCalibration head = {}, std::map<std::string, HeadCalibration> by_line = {})
        : head(std::move(head)), by_line(std::move(by_line)) {}
    const HeadCalibration& of(const std::string& line) const {
        const auto found = by_line.find(line);
        return found == by_line.end() ? head : found->second;
    }
};

}  // namespace stepdiag
