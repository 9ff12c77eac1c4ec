// Temperatures of the axes' scales at each reading of a run, from its channels: temperature_x, temperature_y and
// temperature_z, or temperature alone, one sensor for all three.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {

// By row, degrees Celsius. A field that is empty is interpolated in time within its pass (the readings of one line in
// one run; in the order of rows where a field's time is not known), with the nearest value at the ends. A pass without
// any takes `otherwise`. Throws InvalidArgument, naming the pass, where there is none.
std::vector<Eigen::Vector3d> scale_temperatures(const Measurement& measurement,
                                                const std::optional<Eigen::Vector3d>& otherwise);

// Whether one sensor, or one statement, serves all three axes, so that its deviation is common to them.
bool has_one_sensor(const Measurement& measurement);

// Means over all readings of what the channels say, by axis; none where no channel says anything.
std::optional<Eigen::Vector3d> mean_scale_temperatures(const Measurement& measurement);

}  // namespace stepdiag
