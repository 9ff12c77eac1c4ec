// What a run records beside its readings: temperatures of the axes' scales (channels temperature_x, temperature_y and
// temperature_z, or temperature alone, one sensor for all three), and the air (air_temperature, air_pressure,
// air_humidity). A field that is empty is interpolated in time within its pass, the readings of one line in one run (in
// the order of rows where a time is not known), with the nearest value at the ends. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {

// What a channel recorded at these rows of a pass; empty where it recorded nothing there, or there is no channel.
std::vector<double> recorded(const Measurement& measurement, const Channel* channel,
                             const std::vector<std::size_t>& rows);

// By row, degrees Celsius. A pass without any takes `otherwise`. Throws InvalidArgument, naming the pass, where there
// is none.
std::vector<Eigen::Vector3d> scale_temperatures(const Measurement& measurement,
                                                const std::optional<Eigen::Vector3d>& otherwise);

// By row: how much this record (time, or a temperature) has grown since the run's first reading; s or K; 0 for a row
// without readings of which it says nothing. Throws InvalidArgument, naming the row, where another one has none; of
// time nothing is interpolated.
std::vector<double> since_first_reading(const Measurement& measurement, const std::string& record);

// Whether one sensor, or one statement, serves all three axes, so that its deviation is common to them.
bool has_one_sensor(const Measurement& measurement);

// Means over all readings of what the channels say, by axis; none where no channel says anything.
std::optional<Eigen::Vector3d> mean_scale_temperatures(const Measurement& measurement);

}  // namespace stepdiag
