#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <tuple>

#include "core/text_file.hpp"
#include "measurement/channel_column.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {
namespace {

std::optional<int> parse_integer(std::string_view text) {
    int value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
    return value;
}

std::string column_name(const Channel& channel) { return channel.name + "_" + channel_column(channel.name)->unit; }

std::string uncertainty_column_name(const Channel& channel) {
    return "u_" + channel.name + "_" + channel_column(channel.name)->uncertainty_unit;
}

class Reader {
public:
    Reader(std::string_view text, const std::string& file_name)
        : file_name_(file_name), csv_(parse_csv(text, file_name)) {}

    Measurement read() {
        check_format(csv_, file_name_, {"stepdiag measurement 1"});
        find_columns();
        std::vector<Station> stations;
        for (const CsvRow& row : csv_.rows) {
            stations.push_back(station(row));
            for (const Column& column : channel_columns_) read_field(row, column);
        }
        if (stations.empty()) throw InvalidArgument(file_name_ + ": has a header but no rows");
        reject_repeated_keys(stations);
        try {
            return without_lost_marks(Measurement(std::move(stations), std::move(channels_)));
        } catch (const InvalidArgument& error) {
            throw InvalidArgument(file_name_ + ": " + error.what());
        }
    }

private:
    struct Column {
        std::size_t field;
        std::size_t channel;
        bool uncertainty;
    };

    [[noreturn]] void fail(int line, const std::string& why) const {
        throw InvalidArgument(file_name_ + ", line " + std::to_string(line) + ": " + why);
    }
    [[noreturn]] void fail(const CsvRow& row, std::size_t field, const std::string& expected) const {
        fail(row.line, csv_.header.fields[field] + ": expected " + expected + ", got \"" + row.fields[field] + "\"");
    }

    std::optional<std::size_t> find(const std::string& name) const {
        const auto& names = csv_.header.fields;
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) return std::nullopt;
        return std::size_t(found - names.begin());
    }

    std::size_t require(const std::string& name) const {
        const auto field = find(name);
        if (!field) fail(csv_.header.line, "the column \"" + name + "\" is missing");
        return *field;
    }

    void find_columns() {
        line_ = require("line");
        point_ = require("point");
        position_ = {require("x_mm"), require("y_mm"), require("z_mm")};
        run_ = find("run");
        direction_ = find("direction");
        const auto& names = csv_.header.fields;
        for (std::size_t i = 0; i < names.size(); ++i) {
            if (std::count(names.begin(), names.end(), names[i]) > 1)
                fail(csv_.header.line, "the column \"" + names[i] + "\" is given twice");
            if (i == line_ || i == point_ || i == run_ || i == direction_ ||
                std::count(position_.begin(), position_.end(), i))
                continue;
            const auto unit = names[i].rfind('_');
            const std::string name = names[i].substr(0, unit);
            const bool uncertainty = name.substr(0, 2) == "u_";
            const auto column = channel_column(uncertainty ? name.substr(2) : name);
            if (!column || unit == std::string::npos || (uncertainty && column->uncertainty_unit.empty()) ||
                names[i].substr(unit + 1) != (uncertainty ? column->uncertainty_unit : column->unit))
                fail(csv_.header.line, "unknown column \"" + names[i] +
                                           "\"; columns carry their unit, such as distance_mm, alpha_urad, spot_x_mm, "
                                           "d1_mm, u_distance_um");
            if (!uncertainty) {
                channel_columns_.push_back({i, channels_.size(), false});
                channels_.push_back({name, {}, {}});
            }
        }
        for (std::size_t i = 0; i < names.size(); ++i)
            for (std::size_t c = 0; c < channels_.size(); ++c)
                if (names[i] == uncertainty_column_name(channels_[c])) channel_columns_.push_back({i, c, true});
        for (std::size_t i = 0; i < names.size(); ++i)
            if (names[i].substr(0, 2) == "u_" && std::none_of(channel_columns_.begin(), channel_columns_.end(),
                                                              [&](const Column& c) { return c.field == i; }))
                fail(csv_.header.line, "the column \"" + names[i] + "\" has no corresponding column of readings");
    }

    Station station(const CsvRow& row) const {
        const auto line = [&] {
            try {
                return Line::parse(row.fields[line_]);
            } catch (const InvalidArgument& error) {
                fail(row.line, error.what());
            }
        }();
        Station station{0, line, 0, Direction::forward, Eigen::Vector3d::Zero()};
        const auto integer = [&](std::size_t field, int lowest) {
            const auto value = parse_integer(row.fields[field]);
            if (!value || *value < lowest)
                fail(row, field, "a whole number" + std::string(lowest == 0 ? " of at least 0" : ""));
            return *value;
        };
        station.point = integer(point_, 0);
        if (run_ && !row.fields[*run_].empty()) station.run = integer(*run_, std::numeric_limits<int>::min());
        if (direction_ && !row.fields[*direction_].empty()) {
            const std::string& text = row.fields[*direction_];
            if (text != "forward" && text != "backward") fail(row, *direction_, "forward or backward");
            station.direction = text == "forward" ? Direction::forward : Direction::backward;
        }
        for (int a = 0; a < 3; ++a) {
            const auto value = parse_decimal(row.fields[position_[a]], 0);
            if (!value) fail(row, position_[a], "a finite decimal number");
            station.commanded[a] = *value;
        }
        return station;
    }

    void read_field(const CsvRow& row, const Column& column) {
        Channel& channel = channels_[column.channel];
        const ChannelColumn format = *channel_column(channel.name);
        const std::string& text = row.fields[column.field];
        std::optional<double> value;
        if (!text.empty()) {
            value = parse_decimal(text, column.uncertainty ? format.uncertainty_shift : format.exponent_shift);
            if (!value || (column.uncertainty && !is_usable_uncertainty(*value)))
                fail(row, column.field,
                     column.uncertainty ? "an empty field or a standard uncertainty of 1e-12 to 1e6 mm or rad"
                                        : "a finite decimal number, or an empty field for a lost reading");
        }
        (column.uncertainty ? channel.standard_uncertainty : channel.value).push_back(value);
    }

    void reject_repeated_keys(const std::vector<Station>& stations) const {
        std::vector<std::size_t> order(stations.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        const auto key = [&](std::size_t i) {
            return std::make_tuple(stations[i].run, stations[i].line.name(), stations[i].point);
        };
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
        for (std::size_t i = 1; i < order.size(); ++i)
            if (key(order[i]) == key(order[i - 1])) {
                const Station& station = stations[order[i]];
                fail(csv_.rows[order[i]].line, "run " + std::to_string(station.run) + ", line " + station.line.name() +
                                                   ", point " + std::to_string(station.point) +
                                                   " is already given in line " +
                                                   std::to_string(csv_.rows[order[i - 1]].line));
            }
    }

    const std::string& file_name_;
    CsvFile csv_;
    std::size_t line_ = 0, point_ = 0;
    std::array<std::size_t, 3> position_{};
    std::optional<std::size_t> run_, direction_;
    std::vector<Column> channel_columns_;
    std::vector<Channel> channels_;
};

}  // namespace

bool is_beam_channel(std::string_view name) {
    return name.size() >= 2 && name[0] == 'd' && name[1] != '0' &&
           name.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

std::optional<ChannelColumn> channel_column(std::string_view channel) {
    if (channel == "alpha" || channel == "beta") return ChannelColumn{"urad", -6, "urad", -6};
    if (channel == "distance" || channel == "spot_x" || channel == "spot_y" || is_beam_channel(channel))
        return ChannelColumn{"mm", 0, "um", -3};
    if (channel == "time") return ChannelColumn{"s", 0, "", 0};
    if (channel == "temperature" || channel == "temperature_x" || channel == "temperature_y" ||
        channel == "temperature_z" || channel == "air_temperature")
        return ChannelColumn{"c", 0, "", 0};
    if (channel == "air_pressure") return ChannelColumn{"hpa", 2, "", 0};
    if (channel == "air_humidity") return ChannelColumn{"percent", -2, "", 0};
    return std::nullopt;
}

bool is_signal(std::string_view name) {
    const auto column = channel_column(name);
    return column && !column->uncertainty_unit.empty();  // records state none
}

Measurement parse_measurement(std::string_view text, const std::string& file_name) {
    return Reader(text, file_name).read();
}

Measurement read_measurement(const std::string& path) { return parse_measurement(read_text_file(path), path); }

std::string format_measurement(const Measurement& measurement) {
    const auto& stations = measurement.stations();
    const bool runs = std::any_of(stations.begin(), stations.end(), [](const Station& s) { return s.run != 0; });
    const bool directions = std::any_of(stations.begin(), stations.end(),
                                        [](const Station& s) { return s.direction == Direction::backward; });
    std::string text = "line,point,x_mm,y_mm,z_mm";
    for (const Channel& channel : measurement.channels()) text += "," + column_name(channel);
    for (const Channel& channel : measurement.channels())
        if (!channel.standard_uncertainty.empty()) text += "," + uncertainty_column_name(channel);
    text += std::string(runs ? ",run" : "") + (directions ? ",direction" : "") + "\n";

    const auto field = [](std::optional<double> value, int shift) {
        return "," + (value ? format_decimal(*value, -shift) : "");
    };
    for (std::size_t i = 0; i < stations.size(); ++i) {
        text += stations[i].line.name() + "," + std::to_string(stations[i].point);
        for (int a = 0; a < 3; ++a) text += "," + format_decimal(stations[i].commanded[a], 0);
        for (const Channel& channel : measurement.channels())
            text += field(channel.value[i], channel_column(channel.name)->exponent_shift);
        for (const Channel& channel : measurement.channels())
            if (!channel.standard_uncertainty.empty())
                text += field(channel.standard_uncertainty[i], channel_column(channel.name)->uncertainty_shift);
        if (runs) text += "," + std::to_string(stations[i].run);
        if (directions) text += std::string(",") + name(stations[i].direction);
        text += "\n";
    }
    return text;
}

void write_measurement(const Measurement& measurement, const std::string& path) {
    write_text_file(path, format_measurement(measurement));
}

}  // namespace stepdiag
