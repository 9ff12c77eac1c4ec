// What evaluators know of a head: the constants that its readings are reduced with, and nothing of its errors.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stepdiag {

struct HeadCalibration {
    // Layout psd: the unfolded plane of the position sensing device behind the reference plane, mm; reduced, that is,
    // glass of thickness t counts as t n_air/n.
    std::optional<double> psd_distance = {};
    // Layout multi_beam: (u, v) of the beams d1 ... dn in the sensor frame, mm.
    std::vector<Eigen::Vector2d> beam_offsets = {};
    // Layout psd: (u, v) of the beam that makes the spot, mm.
    Eigen::Vector2d spot_beam = Eigen::Vector2d::Zero();
    // What windows and splitters add to each distance of a nominal head, mm; the head has taken it off its readings.
    std::vector<double> head_constants = {};
    // From the beam's origin to the line's first commanded functional point, mm.
    double standoff = 100.0;
};

// Of all lines' heads.
struct HeadCalibrations {
    HeadCalibration head;
    std::map<std::string, HeadCalibration> by_line;  // of the lines that have another one, by name

    HeadCalibrations(HeadCalibration head = {}, std::map<std::string, HeadCalibration> by_line = {})
        : head(std::move(head)), by_line(std::move(by_line)) {}
    const HeadCalibration& of(const std::string& line) const {
        const auto found = by_line.find(line);
        return found == by_line.end() ? head : found->second;
    }
};

}  // namespace stepdiag
