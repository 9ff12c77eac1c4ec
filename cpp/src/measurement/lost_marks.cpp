#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/text_file.hpp"
#include "measurement/channel_column.hpp"
#include "measurement/row_name.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {
namespace {

// A number that a line has twice may be a point that was read twice.
constexpr int most_repeats = 2;

bool is_distance(const Channel& channel) { return channel.name == "distance" || is_beam_channel(channel.name); }

// As in a file, without ".0".
std::string text_of(const Channel& channel, std::size_t row) {
    const std::string text = format_decimal(*channel.value[row] + 0.0, -channel_column(channel.name)->exponent_shift);
    return text.substr(0, text.rfind(".0") == text.size() - 2 ? text.size() - 2 : text.size());
}

bool is_nines(const std::string& text) {
    const auto nines = std::count(text.begin(), text.end(), '9');
    return nines >= 3 && text.find_first_of("012345678e") == std::string::npos;
}

// Whether all readings of a row, and more than one, are this number.
bool is_filled(const Measurement& measurement, std::size_t row, const std::string& number) {
    int count = 0;
    for (const Channel& channel : measurement.channels())
        if (is_signal(channel.name)) {
            if (!channel.value[row] || text_of(channel, row) != number) return false;
            ++count;
        }
    return count > 1;
}

// The box that all commanded positions span: the volume, but for what no line reaches.
Eigen::Vector3d spanned(const std::vector<Station>& stations) {
    Eigen::Vector3d low = stations.front().commanded, high = low;
    for (const Station& station : stations) {
        low = low.cwiseMin(station.commanded);
        high = high.cwiseMax(station.commanded);
    }
    return high - low;
}

// One channel of distances in one pass.
struct PassDistances {
    std::vector<std::size_t> row;
    std::vector<std::string> text;
    std::vector<bool> fills_row;         // whether all readings of its row are this number
    std::vector<double> travel, offset;  // mm; offset: distance less travel

    // The marks that are not where their neighbours are that are none, and how far from there. A pass of nothing but
    // marks has no neighbours: its distances do not grow, which evaluations refuse.
    std::vector<std::pair<std::size_t, double>> misplaced_marks(double tolerance) const {
        std::map<std::string, int> times;
        for (const std::string& one : text) ++times[one];
        std::vector<std::size_t> marks;
        std::vector<std::pair<double, double>> others;  // travel and offset
        for (std::size_t i = 0; i < row.size(); ++i)
            if (text[i] == "0" || is_nines(text[i]) || times[text[i]] > most_repeats || fills_row[i])
                marks.push_back(i);
            else others.emplace_back(travel[i], offset[i]);
        if (others.empty()) return {};
        std::sort(others.begin(), others.end());
        std::vector<std::pair<std::size_t, double>> misplaced;
        for (const std::size_t i : marks) {
            double far = std::numeric_limits<double>::infinity();
            const auto next = std::lower_bound(others.begin(), others.end(), std::pair(travel[i], offset[i]));
            if (next != others.end()) far = offset[i] - next->second;
            if (next != others.begin() && std::abs(offset[i] - (next - 1)->second) < std::abs(far))
                far = offset[i] - (next - 1)->second;
            if (std::abs(far) > tolerance) misplaced.emplace_back(i, far);
        }
        return misplaced;
    }
};

std::map<std::pair<int, std::string>, PassDistances> by_pass(const Measurement& measurement, const Channel& channel,
                                                             const Eigen::Vector3d& span) {
    std::map<std::pair<int, std::string>, PassDistances> passes;
    for (std::size_t row = 0; row < measurement.size(); ++row) {
        if (!channel.value[row]) continue;
        const Station& station = measurement.stations()[row];
        Eigen::Vector3d along = Eigen::Vector3d::Zero();
        for (const Axis axis : all_axes) along[index(axis)] = station.line.sign(axis) * span[index(axis)];
        PassDistances& pass = passes[{station.run, station.line.name()}];
        pass.row.push_back(row);
        pass.text.push_back(text_of(channel, row));
        pass.fills_row.push_back(is_filled(measurement, row, pass.text.back()));
        pass.travel.push_back(along.normalized().dot(station.commanded));
        pass.offset.push_back(*channel.value[row] - pass.travel.back());
    }
    return passes;
}

}  // namespace

Measurement without_lost_marks(const Measurement& measurement) {
    const Eigen::Vector3d span = spanned(measurement.stations());
    double shortest = span.maxCoeff();
    for (const double edge : span)
        if (edge > 0.0) shortest = std::min(shortest, edge);
    const double tolerance = 1e-2 * shortest;  // no machine has such errors: as of far_reading()
    if (!(tolerance > 0.0)) return measurement;

    std::vector<Channel> channels = measurement.channels();
    std::set<std::size_t> dark;
    for (Channel& channel : channels) {
        if (!is_distance(channel)) continue;
        for (const auto& entry : by_pass(measurement, channel, span)) {
            const PassDistances& pass = entry.second;
            const auto marks = pass.misplaced_marks(tolerance);
            for (const auto& [i, far] : marks) {
                if (pass.text[i] != "0")
                    throw InvalidArgument(
                        row_name(measurement.stations()[pass.row[i]], pass.row[i]) + ": " + channel.name + " " +
                        pass.text[i] + " mm is " + std::to_string(std::llround(far)) +
                        " mm from where its neighbours put it; if it marks a lost beam, leave the field empty");
                channel.value[pass.row[i]].reset();
                dark.insert(pass.row[i]);
            }
        }
    }
    if (dark.empty()) return measurement;
    for (Channel& channel : channels)
        if (is_signal(channel.name) && !is_distance(channel))
            for (const std::size_t row : dark)
                if (channel.value[row] == 0.0) channel.value[row].reset();
    return Measurement(measurement.stations(), std::move(channels));
}

}  // namespace stepdiag
