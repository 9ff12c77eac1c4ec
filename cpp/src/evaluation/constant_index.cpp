#include "stepdiag/evaluation/constant_index.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/measurement_rows.hpp"
#include "measurement/records.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

struct Recorded {
    const char* channel;
    double Air::* quantity;
};
constexpr std::array<Recorded, 3> quantities = {{{"air_temperature", &Air::temperature},
                                                 {"air_pressure", &Air::pressure},
                                                 {"air_humidity", &Air::relative_humidity}}};

// By row of the pass.
std::vector<double> indices(const Measurement& measurement, const std::vector<std::size_t>& rows,
                            const Environment& assumed, double wavelength) {
    const bool is_state = std::holds_alternative<Air>(assumed.air);
    std::vector<Environment> air(rows.size(), is_state ? assumed : Environment{Air{}, assumed.equation});
    for (const Recorded& of : quantities) {
        const std::vector<double> values = recorded(measurement, measurement.find(of.channel), rows);
        if (values.empty() && !is_state)
            throw InvalidArgument("readings of a constant index: expected " + std::string(of.channel) +
                                  " recorded on line " + measurement.stations()[rows.front()].line.name() +
                                  ", got none; an assumed index says nothing of it");
        for (std::size_t k = 0; k < values.size(); ++k) std::get<Air>(air[k].air).*of.quantity = values[k];
    }
    std::vector<double> index;
    for (std::size_t k = 0; k < rows.size(); ++k) try {
            index.push_back(refractive_index(air[k], wavelength));
        } catch (const InvalidArgument& error) {
            throw InvalidArgument(row_name(measurement, rows[k]) + ": " + error.what());
        }
    return index;
}

}  // namespace

Measurement in_recorded_air(const Measurement& measurement, const Plan& plan,
                            const std::map<std::string, CountingHead>& head_of_line, const Environment& assumed) {
    bool any = false;
    for (const Recorded& of : quantities) any = any || measurement.find(of.channel);
    if (!any)
        throw InvalidArgument(
            "readings of a constant index: expected a column air_temperature_c, air_pressure_hpa or "
            "air_humidity_percent, got none");
    std::vector<Channel> channels = measurement.channels();
    for (const auto& [pass, rows] : rows_by_pass(measurement)) {
        const Station& first = measurement.stations()[rows.front()];
        const auto planned = planned_points(measurement, rows.front(), plan);
        const auto head = head_of_line.find(first.line.name());
        if (head == head_of_line.end())
            throw InvalidArgument(row_name(measurement, rows.front()) + ": expected the head of this line, got none");
        const double used = refractive_index(assumed, head->second.wavelength);
        const std::vector<double> index = indices(measurement, rows, assumed, head->second.wavelength);
        const Eigen::Vector3d direction = plan.frame(first.line).col(2);
        const auto nominal = [&](std::size_t row) {
            check_station(measurement, row, planned, plan);
            const PlanPoint& point = planned[measurement.stations()[row].point];
            return head->second.standoff + direction.dot(point.commanded - planned.front().commanded);
        };
        for (Channel& channel : channels) {
            if (channel.name.front() != 'd') continue;
            std::optional<std::size_t> start;  // of the rows of the pass: that of the lowest point
            for (std::size_t k = 0; k < rows.size(); ++k)
                if (channel.value[rows[k]] &&
                    (!start || measurement.stations()[rows[k]].point < measurement.stations()[rows[*start]].point))
                    start = k;
            if (!start) continue;
            const double from = *channel.value[rows[*start]], optical = index[*start] * nominal(rows[*start]);
            for (std::size_t k = 0; k < rows.size(); ++k)
                if (auto& value = channel.value[rows[k]]) value = (used * (*value - from) + optical) / index[k];
        }
    }
    return Measurement(measurement.stations(), std::move(channels));
}

}  // namespace stepdiag
