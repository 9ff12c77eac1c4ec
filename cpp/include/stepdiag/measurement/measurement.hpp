// Measurement: the readings of a head at each commanded point. It is the only interface between simulation and
// evaluation. CSV columns:
//   line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad  layout ideal
//   spot_x_mm,spot_y_mm                                         layout psd: instead of alpha and beta
//   d1_mm,d2_mm,d3_mm[,...]                                     layout multi_beam: instead of distance, alpha and beta
//   run, direction, time_s                                      optional
//   temperature_c, or temperature_x_c, _y_c, _z_c               optional: of the axes' scales
//   air_temperature_c, air_pressure_hpa, air_humidity_percent   optional
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
// spot_x, spot_y, d1, d2, ..., time (s), temperature, temperature_x, ... air_temperature (degrees Celsius),
// air_pressure (Pa), air_humidity (0 to 1). A lost reading is empty. `standard_uncertainty` is an empty vector if the
// measurement does not state it.
struct Channel {
    std::string name;
    std::vector<std::optional<double>> value;
    std::vector<std::optional<double>> standard_uncertainty = {};
};

// Whether a channel of this name is read by the head, and not a record of time, temperatures or air.
bool is_signal(std::string_view name);

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

// What loggers write in place of a reading whose beam was lost. A distance of exactly 0 that is not where the other
// distances of its pass put it is lost, and with it the tilts or spots of its row that are 0. Another number that is
// not there either, and stands there more than twice, fills all fields of its row or is all nines, may be a mark or a
// mistake: throws InvalidArgument, which names the row. A counter that is zeroed at its line's first point reads 0
// there as it should.
Measurement without_lost_marks(const Measurement& measurement);

// Both throw InvalidArgument, which names file and line, for invalid content, and are without_lost_marks().
Measurement read_measurement(const std::string& path);
Measurement parse_measurement(std::string_view text, const std::string& file_name);
// Writes to a temporary file beside `path`, then renames it. Reading the file gives the same bits.
void write_measurement(const Measurement& measurement, const std::string& path);
std::string format_measurement(const Measurement& measurement);

}  // namespace stepdiag
