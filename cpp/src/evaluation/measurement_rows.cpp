#include "evaluation/measurement_rows.hpp"

#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/plausibility.hpp"

namespace stepdiag {
namespace {

constexpr double position_tolerance = 1e-3;  // mm; many controllers write positions with three decimals

bool is_at(const Station& station, const std::vector<PlanPoint>& planned) {
    return station.point < int(planned.size()) &&
           (station.commanded - planned[station.point].commanded).cwiseAbs().maxCoeff() <= position_tolerance;
}

// Of a row that is not where the plan has it: whether it is where its scale line would be read the other way.
bool is_of_other_scale_points(const Station& station, const Plan& plan) {
    if (!plan.is_scale_line(station.line)) return false;
    const ScalePoints other = plan.scale_points() == ScalePoints::ends ? ScalePoints::steps : ScalePoints::ends;
    const Plan as_read(plan.volume(), {}, plan.steps(), plan.order(), {station.line}, {}, other);
    return is_at(station, as_read.points(station.line));
}

void check_head_fits(const HeadCalibration& head, int beams, bool has_spots) {
    if (beams > 0 && beams != int(head.beam_offsets.size()))
        throw InvalidArgument("measurement: has " + std::to_string(beams) + " beams d1 ... d" + std::to_string(beams) +
                              ", but the head's beam_offsets name " + std::to_string(head.beam_offsets.size()));
    if (has_spots && !head.psd_distance)
        throw InvalidArgument("measurement: has spot readings, but the head has no psd_distance (layout \"psd\")");
}

}  // namespace

std::string row_name(const Measurement& measurement, std::size_t row) {
    const Station& station = measurement.stations()[row];
    return "data row " + std::to_string(row + 1) + " (run " + std::to_string(station.run) + ", line " +
           station.line.name() + ", point " + std::to_string(station.point) + ")";
}

std::optional<RawValue> raw_value(const Channel* channel, std::size_t row, double usual_uncertainty) {
    if (!channel || !channel->value[row]) return std::nullopt;
    const auto own = channel->standard_uncertainty.empty() ? std::nullopt : channel->standard_uncertainty[row];
    return RawValue{*channel->value[row], own.value_or(usual_uncertainty)};
}

std::map<std::pair<int, std::string>, std::vector<std::size_t>> rows_by_pass(const Measurement& measurement) {
    std::map<std::pair<int, std::string>, std::vector<std::size_t>> rows;
    for (std::size_t i = 0; i < measurement.size(); ++i)
        rows[{measurement.stations()[i].run, measurement.stations()[i].line.name()}].push_back(i);
    return rows;
}

void check_uncertainty(const ReadingUncertainty& uncertainty) {
    for (const auto& [key, u] : {std::pair("distance", uncertainty.distance), std::pair("tilt", uncertainty.tilt),
                                 std::pair("spot", uncertainty.spot)})
        if (!(u > 0.0 && std::isfinite(u)))
            throw InvalidArgument(std::string("uncertainty.") + key +
                                  ": expected a positive finite standard uncertainty");
}

void check_heads_fit(const Measurement& measurement, const HeadCalibrations& heads, bool spots_count) {
    const int beams = measurement.beam_count();
    const bool has_spots = spots_count && measurement.find("spot_x");
    check_head_fits(heads.head, beams, has_spots);
    for (const auto& entry : heads.by_line) check_head_fits(entry.second, beams, has_spots);
}

std::vector<PlanPoint> planned_points(const Measurement& measurement, std::size_t row, const Plan& plan) {
    try {
        return plan.points(measurement.stations()[row].line, measurement.stations()[row].run);
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(row_name(measurement, row) + ": " + error.what());
    }
}

void check_station(const Measurement& measurement, std::size_t row, const std::vector<PlanPoint>& planned,
                   const Plan& plan) {
    const Station& station = measurement.stations()[row];
    if (is_at(station, planned)) return;
    if (is_of_other_scale_points(station, plan))
        throw InvalidArgument(row_name(measurement, row) + ": " +
                              (plan.scale_points() == ScalePoints::ends ? read_at_every_step : read_at_its_ends));
    if (station.point >= int(planned.size()))
        throw InvalidArgument(row_name(measurement, row) + ": the line has the points 0 to " +
                              std::to_string(planned.size() - 1));
    std::ostringstream text;
    text << row_name(measurement, row) << ": the plan has this point at ("
         << planned[station.point].commanded.transpose() << ") mm, the row says (" << station.commanded.transpose()
         << ") mm";
    throw InvalidArgument(text.str());
}

void check_points(const Measurement& measurement, const Plan& plan) {
    for (const auto& entry : rows_by_pass(measurement)) {
        const auto planned = planned_points(measurement, entry.second.front(), plan);
        for (const std::size_t row : entry.second) check_station(measurement, row, planned, plan);
    }
}

}  // namespace stepdiag
