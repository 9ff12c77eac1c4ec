// Measurement: the readings of a head at each commanded point. It is the only interface between simulation and
// evaluation. CSV columns:
//   line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad  layout ideal
//   spot_x_mm,spot_y_mm                                         layout psd: instead of alpha and beta
//   d1_mm,d2_mm,d3_mm[,...]                                     layout multi_beam: instead of distance, alpha and beta
//   run, direction, time_s, temperature_c                       optional
//   u_<field>                                                   optional: standard uncertainty of a field
// An empty field is a lost reading and a missing row is a lost point. Neither is an error.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/plan/run_order.hpp"

namespace stepdiag {

// Place of one row in the plan. (run, line, point) is the key.
struct Station {
    int run = 0;
    Line line;
    int point = 0;
    Direction direction = Direction::forward;
    Eigen::Vector3d commanded;  // mm
};

// Values of one quantity for all rows, in native units (mm, rad). `name` is without unit: distance, alpha, beta,
// spot_x, spot_y, d1, d2, ..., time (s), temperature (degrees Celsius). A lost reading is empty. `standard_uncertainty`
// is an empty vector if the measurement does not state it.
struct Channel {
    std::string name;
    std::vector<std::optional<double>> value;
    std::vector<std::optional<double>> standard_uncertainty = {};
};

// A standard uncertainty outside these bounds (mm, rad) is a mistake. The bounds also keep weights in the range of a
// double.
inline constexpr bool is_usable_uncertainty(double u) { return u >= 1e-12 && u <= 1e6; }

class Measurement {
public:
    // Throws InvalidArgument, which names the row or channel, for different lengths, no rows, a repeated key, a point
    // below 0, positions or readings that are not finite, an uncertainty that is not usable, a channel that is unknown
    // or given twice, or channels that are not those of a head layout (distance, distance+alpha+beta,
    // distance+spot_x+spot_y, d1..dn with n >= 3).
    Measurement(std::vector<Station> stations, std::vector<Channel> channels);

    const std::vector<Station>& stations() const { return stations_; }
    const std::vector<Channel>& channels() const { return channels_; }
    const Channel* find(std::string_view name) const;  // nullptr if there is no such channel
    std::size_t size() const { return stations_.size(); }
    int beam_count() const;  // number of the channels d1 ... dn

private:
    std::vector<Station> stations_;
    std::vector<Channel> channels_;
};

// Both throw InvalidArgument, which names file and line, for invalid content.
Measurement read_measurement(const std::string& path);
Measurement parse_measurement(std::string_view text, const std::string& file_name);
// Writes to a temporary file beside `path`, then renames it. Reading the file gives the same bits.
void write_measurement(const Measurement& measurement, const std::string& path);
std::string format_measurement(const Measurement& measurement);

}  // namespace stepdiag
