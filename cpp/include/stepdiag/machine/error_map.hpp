// The 21 geometric errors of a machine (ISO 230-1) as tables. For each axis a at position p, the map gives the
// translation delta_a(p), which includes the squareness terms, and the rotation vector theta_a(p). Functions are linear
// between nodes. Outside the table, a function keeps its end value; squareness terms continue linearly.
//   delta_Y.x = EXY(y) - C0Y y,  delta_Z.x = EXZ(z) + B0Z z,  delta_Z.y = EYZ(z) - A0Z z
// Choice of frame (CONVENTIONS): functions are 0 at home; straightnesses are 0 at both ends of travel. A function may
// have a second table for nodes approached in - direction, in the same frame. Its values at the ends of travel are
// reversal errors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "stepdiag/machine/parameter_table.hpp"

namespace stepdiag {

// A value that violates the choice of frame, which requires 0 at this position.
struct FrameDeviation {
    FunctionId function;
    double position;  // mm
    double value;     // mm or rad
};

class ErrorMap {
public:
    ErrorMap() = default;  // no errors
    // A parameter that is not in the table is 0. Throws InvalidArgument if positions do not ascend, a number is not
    // finite, an uncertainty is negative, or a function has a table for the - direction only.
    explicit ErrorMap(ParameterTable table);

    Eigen::Vector3d delta(Axis axis, double position, Approach approach = Approach::positive) const;  // mm
    Eigen::Vector3d theta(Axis axis, double position, Approach approach = Approach::positive) const;  // rad
    double function(FunctionId id, double position, Approach approach = Approach::positive) const;    // mm or rad
    double squareness(Squareness squareness) const;                                                   // rad
    const ParameterTable& table() const { return table_; }

    // Violations of the choice of frame: functions that are not 0 at home, and straightnesses that are not 0 at the end
    // of travel, approached in + direction. `volume`: ends of travel, mm. The map is used as given in either case.
    // Throws InvalidArgument for a volume that is not finite.
    std::vector<FrameDeviation> frame_deviations(const Eigen::Vector3d& volume) const;

private:
    ParameterTable table_;
};

// Throws InvalidArgument as read_parameter_table() and ErrorMap(ParameterTable).
ErrorMap read_error_map(const std::string& path);

// Amplitudes of a random machine. Each function is a sum of harmonics, scaled so that its largest absolute node value
// is the amplitude. Positioning errors and rotations also have a slope; straightnesses end at 0. Squarenesses are
// uniformly distributed in [-squareness, +squareness]. `screw_pitch` > 0 adds
// screw_amplitude sin(2 pi p / screw_pitch) to EXX, EYY and EZZ.
struct RandomErrorMap {
    std::uint64_t seed = 0;
    double translation = 0.020;    // mm
    double rotation = 60e-6;       // rad
    double squareness = 60e-6;     // rad
    int intervals = 50;            // between equidistant nodes of each axis
    double screw_pitch = 0.0;      // mm
    double screw_amplitude = 0.0;  // mm
};

// The same volume and options give the same bits. Throws InvalidArgument if the volume, an amplitude, the number of
// intervals or the screw pitch is out of range.
ErrorMap make_random_error_map(const Eigen::Vector3d& volume, const RandomErrorMap& options);

}  // namespace stepdiag
