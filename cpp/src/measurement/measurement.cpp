#include "stepdiag/measurement/measurement.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "measurement/channel_column.hpp"
#include "measurement/row_name.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

void check_names(const std::vector<Channel>& channels) {
    std::set<std::string> names;
    int beams = 0;
    for (const Channel& channel : channels) {
        if (!channel_column(channel.name))
            throw InvalidArgument("channel \"" + channel.name +
                                  "\": expected distance, alpha, beta, spot_x, spot_y, d1 ... dn, time, temperature, "
                                  "temperature_x ... temperature_z, air_temperature, air_pressure or air_humidity");
        if (!names.insert(channel.name).second)
            throw InvalidArgument("channel \"" + channel.name + "\" is given twice");
        beams += is_beam_channel(channel.name);
    }
    const auto has = [&](const char* name) { return names.count(name) > 0; };
    const bool tilt = has("alpha") || has("beta");
    const bool spot = has("spot_x") || has("spot_y");
    bool valid = false;
    if (beams > 0) {
        valid = beams >= 3 && !tilt && !spot && !has("distance");
        for (int i = 1; i <= beams; ++i) valid = valid && has(("d" + std::to_string(i)).c_str());
    } else {
        valid = has("distance") && !(tilt && spot) && has("alpha") == has("beta") && has("spot_x") == has("spot_y");
    }
    if (!valid)
        throw InvalidArgument(
            "channels: expected distance alone, distance with alpha and beta, distance with spot_x and spot_y, or d1 "
            "... dn (n >= 3)");
}

}  // namespace

Measurement::Measurement(std::vector<Station> stations, std::vector<Channel> channels)
    : stations_(std::move(stations)), channels_(std::move(channels)) {
    if (stations_.empty()) throw InvalidArgument("measurement: expected at least one row");
    std::set<std::tuple<int, std::string, int>> keys;
    for (std::size_t i = 0; i < stations_.size(); ++i) {
        const Station& station = stations_[i];
        if (station.point < 0) throw InvalidArgument(row_name(station, i) + ": expected a point number of at least 0");
        if (!station.commanded.allFinite())
            throw InvalidArgument(row_name(station, i) + ": the commanded position must be finite");
        if (!keys.insert({station.run, station.line.name(), station.point}).second)
            throw InvalidArgument(row_name(station, i) + " is given twice; (run, line, point) must be unique");
    }
    check_names(channels_);
    for (const Channel& channel : channels_) {
        const bool weighted = !channel.standard_uncertainty.empty();
        if (channel.value.size() != size() || (weighted && channel.standard_uncertainty.size() != size()))
            throw InvalidArgument("channel \"" + channel.name + "\": expected " + std::to_string(size()) +
                                  " values, one a row");
        for (std::size_t i = 0; i < size(); ++i) {
            if (channel.value[i] && !std::isfinite(*channel.value[i]))
                throw InvalidArgument(row_name(stations_[i], i) + ": " + channel.name +
                                      " must be finite, or absent where it was lost");
            if (weighted && channel.standard_uncertainty[i] && !is_usable_uncertainty(*channel.standard_uncertainty[i]))
                throw InvalidArgument(row_name(stations_[i], i) + ": standard uncertainty of " + channel.name +
                                      " must be 1e-12 to 1e6 mm or rad");
        }
    }
}

const Channel* Measurement::find(std::string_view name) const {
    const auto found =
        std::find_if(channels_.begin(), channels_.end(), [&](const Channel& c) { return c.name == name; });
    return found == channels_.end() ? nullptr : &*found;
}

int Measurement::beam_count() const {
    return int(
        std::count_if(channels_.begin(), channels_.end(), [](const Channel& c) { return is_beam_channel(c.name); }));
}

}  // namespace stepdiag
