// The 21 geometric errors of a machine as tables: per axis a the translation delta_a(p) (with the squareness terms) and
// the rotation vector theta_a(p). Linear between nodes; outside the table the end value holds, the squareness terms go
// on.
//   delta_Y.x = EXY(y) - C0Y y,  delta_Z.x = EXZ(z) + B0Z z,  delta_Z.y = EYZ(z) - A0Z z
// Frame choice (CONVENTIONS): functions are 0 at home, straightnesses 0 at both ends of travel. A function may have
// another table for nodes approached in - direction, in the same frame; what it says at the ends is reversal.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

// A value that is not 0 where the frame choice has 0.
struct FrameDeviation {
    FunctionId function;
    double position;  // mm
    double value;     // mm or rad
};

class ErrorMap {
public:
    ErrorMap() = default;                     // no errors
    explicit ErrorMap(ParameterTable table);  // a missing parameter is 0; checks nodes and finiteness

    Eigen::Vector3d delta(Axis axis, double position, Approach approach = Approach::positive) const;  // mm
    Eigen::Vector3d theta(Axis axis, double position, Approach approach = Approach::positive) const;  // rad
    double function(FunctionId id, double position, Approach approach = Approach::positive) const;
    double squareness(Squareness squareness) const;
    const ParameterTable& table() const { return table_; }

    // Where the map breaks the frame choice: functions that are not 0 at home, straightnesses that are not 0 at the end
    // of travel `volume`, approached in + direction. Such a map is used as given. Throws InvalidArgument for a volume
    // that is not finite.
    std::vector<FrameDeviation> frame_deviations(const Eigen::Vector3d& volume) const;

private:
    ParameterTable table_;
};

ErrorMap read_error_map(const std::string& path);

// Amplitudes of a random machine. Each function is a sum of harmonics scaled so that its largest absolute node value is
// the amplitude; positioning and rotations have a slope as well, straightnesses end at 0. Squarenesses are uniform
// within +-squareness. `screw_pitch` > 0 adds screw_amplitude sin(2 pi p / screw_pitch) to EXX, EYY and EZZ.
struct RandomErrorMap {
    std::uint64_t seed = 0;
    double translation = 0.020;    // mm
    double rotation = 60e-6;       // rad
    double squareness = 60e-6;     // rad
    int intervals = 50;            // per axis, between equidistant nodes
    double screw_pitch = 0.0;      // mm
    double screw_amplitude = 0.0;  // mm
};

// Same options, same bits. Throws InvalidArgument for a volume, amplitude or node count that makes no sense.
ErrorMap make_random_error_map(const Eigen::Vector3d& volume, const RandomErrorMap& options);

}  // namespace stepdiag
