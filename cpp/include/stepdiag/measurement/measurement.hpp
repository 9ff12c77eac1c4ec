// A run's readings: what a head said at each commanded point. The only thing that simulators and evaluators share.
// CSV: header "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad"; spot_x_mm,spot_y_mm may stand for alpha and
// beta, d1_mm,d2_mm,d3_mm[,...] for all three; optional run, direction, time_s, temperature_c and u_<field>, the
// standard uncertainty of a field. An empty field is a lost reading, a missing row a lost point: data, not an error.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/plan/run_order.hpp"

namespace stepdiag {

// One row: where and in which pass it was read. (run, line, point) is the key.
struct Station {
    int run = 0;
    Line line;
    int point = 0;
    Direction direction = Direction::forward;
    Eigen::Vector3d commanded;  // mm
};

// One quantity of all rows, native units; `name` without unit: distance, alpha, beta, spot_x, spot_y, d1, d2, ...,
// time, temperature. A lost reading is empty; `standard_uncertainty` is empty as a whole where the run does not give
// it.
struct Channel {
    std::string name;
    std::vector<std::optional<double>> value;
    std::vector<std::optional<double>> standard_uncertainty = {};
};

// Outside these bounds (mm, rad) a weight is a mistake, and its square would leave the range of a double.
inline constexpr bool is_usable_uncertainty(double u) { return u >= 1e-12 && u <= 1e6; }

class Measurement {
public:
    // Throws InvalidArgument naming row or channel: lengths that differ, a key given twice, a point below 0, positions
    // or readings that are not finite, an uncertainty that is not usable, a channel unknown or given twice, or
    // channels that make no head's readings (distance, distance+alpha+beta, distance+spot_x+spot_y, d1..dn with n >=
    // 3).
    Measurement(std::vector<Station> stations, std::vector<Channel> channels);

    const std::vector<Station>& stations() const { return stations_; }
    const std::vector<Channel>& channels() const { return channels_; }
    const Channel* find(std::string_view name) const;  // nullptr where the run has no such channel
    std::size_t size() const { return stations_.size(); }
    int beam_count() const;  // channels d1 ... dn

private:
    std::vector<Station> stations_;
    std::vector<Channel> channels_;
};

// Throw InvalidArgument naming file and line.
Measurement read_measurement(const std::string& path);
Measurement parse_measurement(std::string_view text, const std::string& file_name);
// Writes to a temporary file beside `path`, then renames it. A number written is read back to the same bits.
void write_measurement(const Measurement& measurement, const std::string& path);
std::string format_measurement(const Measurement& measurement);

}  // namespace stepdiag
