#include "measurement/records.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr std::array<const char*, 3> own_channel = {"temperature_x", "temperature_y", "temperature_z"};

const Channel* channel_of(const Measurement& measurement, int axis) {
    const Channel* own = measurement.find(own_channel[axis]);
    return own ? own : measurement.find("temperature");
}

// What is empty, between what is there; false where nothing is.
bool fill(std::vector<std::optional<double>>& values, const std::vector<double>& place) {
    const std::size_t count = values.size();
    std::size_t before = count;  // the last one that was read
    for (std::size_t k = 0; k < count; ++k) {
        if (!values[k]) continue;
        for (std::size_t i = before == count ? 0 : before + 1; i < k; ++i) {
            const double span = before == count ? 0.0 : place[k] - place[before];
            const double share = span > 0.0 ? (place[i] - place[before]) / span : 1.0;
            values[i] = before == count ? *values[k] : *values[before] + share * (*values[k] - *values[before]);
        }
        before = k;
    }
    if (before == count) return false;
    for (std::size_t i = before + 1; i < count; ++i) values[i] = values[before];
    return true;
}

// Times of the rows, or their numbers where one has no time or times do not ascend.
std::vector<double> places(const Measurement& measurement, const std::vector<std::size_t>& rows) {
    const Channel* time = measurement.find("time");
    std::vector<double> place;
    for (const std::size_t row : rows) {
        if (!time || !time->value[row] || (!place.empty() && !(*time->value[row] >= place.back()))) break;
        place.push_back(*time->value[row]);
    }
    if (place.size() == rows.size()) return place;
    place.clear();
    for (std::size_t k = 0; k < rows.size(); ++k) place.push_back(double(k));
    return place;
}

// The rows of each pass, in their order.
std::vector<std::vector<std::size_t>> recorded_passes(const Measurement& measurement) {
    std::map<std::pair<int, std::string>, std::vector<std::size_t>> passes;
    for (std::size_t row = 0; row < measurement.size(); ++row)
        passes[{measurement.stations()[row].run, measurement.stations()[row].line.name()}].push_back(row);
    std::vector<std::vector<std::size_t>> list;
    for (auto& [pass, rows] : passes) list.push_back(std::move(rows));
    return list;
}

bool was_read(const Measurement& measurement, std::size_t row) {
    for (const Channel& channel : measurement.channels())
        if (is_signal(channel.name) && channel.value[row]) return true;
    return false;
}

}  // namespace

std::vector<double> recorded(const Measurement& measurement, const Channel* channel,
                             const std::vector<std::size_t>& rows) {
    if (!channel) return {};
    std::vector<std::optional<double>> values;
    for (const std::size_t row : rows) values.push_back(channel->value[row]);
    if (!fill(values, places(measurement, rows))) return {};
    std::vector<double> all;
    for (const auto& value : values) all.push_back(*value);
    return all;
}

std::vector<double> since_first_reading(const Measurement& measurement, const std::string& record) {
    const Channel* channel = measurement.find(record);
    const bool is_time = record == "time";
    std::vector<std::optional<double>> found(measurement.size());
    std::optional<double> start;
    for (const auto& rows : recorded_passes(measurement)) {
        const std::vector<double> of_pass = recorded(measurement, channel, rows);
        for (std::size_t k = 0; k < rows.size(); ++k) {
            const std::size_t row = rows[k];
            if (!of_pass.empty() && (!is_time || channel->value[row])) {
                found[row] = of_pass[k];
                if (is_time) start = std::min(start.value_or(of_pass[k]), of_pass[k]);
            } else if (was_read(measurement, row)) {
                const Station& station = measurement.stations()[row];
                throw InvalidArgument("run " + std::to_string(station.run) + ", line " + station.line.name() +
                                      ", point " + std::to_string(station.point) + ": a machine drift with \"" +
                                      record + "\" needs that column");
            }
        }
    }
    std::vector<double> since(found.size(), 0.0);
    for (std::size_t row = 0; row < found.size(); ++row)
        if (found[row]) {
            if (!start) start = found[row];
            since[row] = *found[row] - *start;
        }
    return since;
}

std::vector<Eigen::Vector3d> scale_temperatures(const Measurement& measurement,
                                                const std::optional<Eigen::Vector3d>& otherwise) {
    std::vector<Eigen::Vector3d> temperatures(measurement.size());
    for (const std::vector<std::size_t>& rows : recorded_passes(measurement))
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<double> values = recorded(measurement, channel_of(measurement, axis), rows);
            if (values.empty() && !otherwise) {
                const Station& station = measurement.stations()[rows.front()];
                throw InvalidArgument("run " + std::to_string(station.run) + ", line " + station.line.name() +
                                      ": expected temperatures (column " + own_channel[axis] +
                                      "_c or temperature_c, or the scales' usual temperature), got none");
            }
            if (values.empty()) values.assign(rows.size(), (*otherwise)[axis]);
            for (std::size_t k = 0; k < rows.size(); ++k) temperatures[rows[k]][axis] = values[k];
        }
    return temperatures;
}

bool has_one_sensor(const Measurement& measurement) {
    for (const char* name : own_channel)
        if (measurement.find(name)) return false;
    return true;
}

std::optional<Eigen::Vector3d> mean_scale_temperatures(const Measurement& measurement) {
    Eigen::Vector3d mean;
    for (int axis = 0; axis < 3; ++axis) {
        const Channel* channel = channel_of(measurement, axis);
        double sum = 0.0;
        int count = 0;
        for (std::size_t row = 0; channel && row < measurement.size(); ++row)
            if (const auto& value = channel->value[row]) sum += *value, ++count;
        if (count == 0) return std::nullopt;
        mean[axis] = sum / count;
    }
    return mean;
}

}  // namespace stepdiag
