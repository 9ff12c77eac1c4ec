#include "stepdiag/evaluation/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "evaluation/measurement_rows.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

std::string text(double number) {
    std::ostringstream out;
    out.precision(4);
    out << number;
    return out.str();
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Distances of one line in one run, and the plan's travel along it.
struct LineDistances {
    std::vector<std::size_t> row;
    std::vector<double> travel, distance;  // mm

    // Ratio of distance to travel: the median over pairs of readings half a line apart; 1 where all stand together.
    double growth() const {
        const std::size_t half = (row.size() + 1) / 2;
        std::vector<double> ratios;
        for (std::size_t i = 0; i + half < row.size(); ++i)
            if (travel[i + half] != travel[i])  // not both at a check point
                ratios.push_back((distance[i + half] - distance[i]) / (travel[i + half] - travel[i]));
        return ratios.empty() ? 1.0 : median(std::move(ratios));
    }

    // Deviations of the readings from the line that most of them lie on, mm.
    std::vector<double> deviations() const {
        std::vector<double> offsets;
        for (std::size_t i = 0; i < row.size(); ++i) offsets.push_back(distance[i] - travel[i]);
        const double usual = median(offsets);
        for (double& offset : offsets) offset -= usual;
        return offsets;
    }
};

LineDistances distances_of(const Measurement& measurement, const std::vector<std::size_t>& rows, const Plan& plan) {
    LineDistances line;
    const Channel* channel = measurement.find(measurement.beam_count() > 0 ? "d1" : "distance");
    if (!channel) return line;
    const Eigen::Vector3d direction = plan.frame(measurement.stations()[rows.front()].line).col(2);
    for (const std::size_t row : rows)
        if (const auto value = channel->value[row]) {
            line.row.push_back(row);
            line.travel.push_back(direction.dot(measurement.stations()[row].commanded));
            line.distance.push_back(*value);
        }
    return line;
}

std::string unit_like(double growth) {
    constexpr double likeness = 0.02;
    for (const auto& [factor, words] :
         {std::pair(1e-3, "are they in m? Expected mm"), std::pair(1e3, "are they in um? Expected mm"),
          std::pair(0.1, "are they in cm? Expected mm"), std::pair(1.0 / 25.4, "are they in inches? Expected mm"),
          std::pair(2.0, "are they the whole way to the mirror and back? Expected half of it"),
          std::pair(0.5, "have they been halved twice?"),
          std::pair(-1.0, "expected distances that grow while the mirror moves away from the head")})
        if (std::abs(growth / factor - 1.0) < likeness) return words;
    return std::abs(growth) < likeness ? "they hardly change; expected readings in mm"
                                       : "expected readings in mm, of this plan and volume";
}

// Suggests edges of the volume that would explain the positioning errors.
std::string volume_like(const Calibration& calibration, const PlausibleLimits& limits) {
    std::string edges;
    for (const Axis axis : all_axes) {
        const double edge = calibration.volume[index(axis)];
        const auto& function = calibration.functions[FunctionId{axis, Component(index(axis))}.index()];
        if (!function || !function->slope_determined) continue;
        const double growth = function->value.back();
        if (std::isfinite(growth) && std::abs(growth) > limits.positioning * edge)
            edges += (edges.empty() ? "" : ", ") + std::string(1, letter(axis)) + " = " + text(edge + growth) +
                     " mm instead of " + text(edge) + " mm";
    }
    return edges.empty() ? edges : "the readings fit a travel of " + edges + ": is the volume right?";
}

constexpr double tolerance = 0.05;  // of growth: ten times the effect of a misalignment of 0.1 rad

// Of points 0 and 1 of a scale line whose positions are those of the plan, as an import fills them in.
void refuse_ends_as_steps(const Measurement& measurement, const Plan& plan) {
    if (plan.scale_points() == ScalePoints::ends || plan.steps() == 1) return;
    for (const auto& entry : rows_by_pass(measurement)) {
        if (!plan.is_scale_line(measurement.stations()[entry.second.front()].line)) continue;
        const LineDistances line = distances_of(measurement, entry.second, plan);
        if (line.row.size() == 2 && std::abs(line.growth() / plan.steps() - 1.0) < tolerance)
            throw InvalidArgument(row_name(measurement, entry.second.front()) + ": " + read_at_its_ends);
    }
}

// A sentence about the first line with at least so many readings whose distances do not grow with the plan's travel;
// empty if there is none.
std::string foreign_distances(const Measurement& measurement, const Plan& plan, std::size_t fewest) {
    for (const auto& entry : rows_by_pass(measurement)) {
        const LineDistances line = distances_of(measurement, entry.second, plan);
        if (line.row.size() < fewest) continue;
        const double growth = line.growth();
        if (!(std::abs(growth - 1.0) < tolerance))
            return "run " + std::to_string(entry.first.first) + ", line " + entry.first.second +
                   ": the distances grow by " + text(growth) + " mm for each mm of the plan's travel; " +
                   unit_like(growth);
    }
    return "";
}

// The value that exceeds its limit by the largest factor.
struct Excess {
    double factor = 1.0;
    std::string parameter, limit_name;
    double position = 0.0, value = 0.0, limit = 0.0;
    bool is_angle = false;

    void note(const Excess& other, double uncertainty) {
        const double slack = std::isnan(uncertainty) ? 0.0 : 3.0 * uncertainty;
        const double by = (std::abs(other.value) - slack) / other.limit;
        if (by <= factor || std::isnan(factor)) return;  // a value that is not a number counts as the worst
        *this = other;
        factor = by;
    }

    std::string sentence() const {
        const double unit = is_angle ? microradian : 1.0;
        const std::string name = is_angle ? " urad" : " mm";
        return parameter + (std::isnan(position) ? "" : " at " + text(position) + " mm") + " comes out as " +
               text(value / unit) + name + ", beyond what a machine can be (" + text(limit / unit) + name +
               ", the plausible limit of " + limit_name + ")";
    }
};

}  // namespace

void check(const PlausibleLimits& limits) {
    for (const auto& [key, value] :
         {std::pair("positioning", limits.positioning), std::pair("translation", limits.translation),
          std::pair("rotation", limits.rotation)})
        if (!(value > 0.0)) throw InvalidArgument(std::string("plausible ") + key + ": expected a positive limit");
}

void refuse_foreign_distances(const Measurement& measurement, const Plan& plan) {
    constexpr std::size_t enough = 8;  // readings, of which two may be wrong
    refuse_ends_as_steps(measurement, plan);
    const std::string sentence = foreign_distances(measurement, plan, enough);
    if (!sentence.empty()) throw InvalidArgument(sentence);
}

std::string far_reading(const Measurement& measurement, const Plan& plan) {
    constexpr double far = 1e-2;  // of the shortest edge of the volume: no machine has such errors
    double largest = far * plan.volume().minCoeff();
    std::string place;
    for (const auto& entry : rows_by_pass(measurement)) {
        const LineDistances line = distances_of(measurement, entry.second, plan);
        if (line.row.size() < 3) continue;
        const std::vector<double> deviations = line.deviations();
        for (std::size_t i = 0; i < deviations.size(); ++i)
            if (!(std::abs(deviations[i]) <= largest)) {
                largest = std::abs(deviations[i]);
                place = row_name(measurement, line.row[i]) + ": the distance " + text(line.distance[i]) + " mm is " +
                        text(deviations[i]) + " mm from where the other readings of its line put it";
            }
    }
    return place;
}

void refuse_implausible(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                        const PlausibleLimits& limits) {
    constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
    Excess worst;
    for (int i = 0; i < function_count; ++i) {
        const auto& f = calibration.functions[i];
        if (!f) continue;
        const FunctionId id = FunctionId::at(i);
        const double edge = calibration.volume[index(id.axis)];
        const bool is_angle = id.is_rotation();
        for (std::size_t k = 0; k < f->value.size(); ++k) {
            const double position = f->position[k], value = f->value[k], u = f->standard_uncertainty[k];
            if (id.is_positioning())
                worst.note({1.0, id.name(), "positioning", position, value, limits.positioning * edge, false}, u);
            worst.note({1.0, id.name(), is_angle ? "rotation" : "translation", position, value,
                        is_angle ? limits.rotation : limits.translation, is_angle},
                       u);
        }
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)])
            worst.note({1.0, name(s), "rotation", nowhere, entry->value, limits.rotation, true},
                       entry->standard_uncertainty);
    if (worst.parameter.empty()) return;
    std::string cause = far_reading(measurement, plan);
    if (cause.empty()) cause = foreign_distances(measurement, plan, 2);
    if (cause.empty()) cause = volume_like(calibration, limits);
    if (cause.empty()) cause = "are these the readings of this plan and head, with tilts in the unit of their column?";
    throw InvalidArgument(worst.sentence() + "; " + cause);
}

}  // namespace stepdiag
