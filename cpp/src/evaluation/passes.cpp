#include "evaluation/passes.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "evaluation/measurement_rows.hpp"
#include "measurement/records.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Reading, and the effects of its raw channels on (distance, alpha, beta).
struct Reduced {
    Reading reading{0.0, 0.0, 0.0};
    bool has_distance = false;
    bool has_tilt = false;
    std::vector<Eigen::Vector3d> effects;

    void take(const ReducedReading& reduced, const std::vector<double>& standard_uncertainty) {
        reading = reduced.reading;
        has_distance = has_tilt = true;
        for (std::size_t c = 0; c < standard_uncertainty.size(); ++c)
            effects.push_back(standard_uncertainty[c] * reduced.jacobian.col(Eigen::Index(c)));
    }
};

// Reduces the raw channels of successive rows.
class Reducer {
public:
    // Ignores tilts and spots if only distances count.
    Reducer(const Measurement& measurement, const HeadCalibrations& heads, const ReadingUncertainty& uncertainty,
            LengthKind kind)
        : measurement_(measurement),
          heads_(heads),
          uncertainty_(uncertainty),
          distance_(measurement.find("distance")),
          alpha_(kind == LengthKind::distance ? nullptr : measurement.find("alpha")),
          beta_(kind == LengthKind::distance ? nullptr : measurement.find("beta")),
          spot_x_(kind == LengthKind::distance ? nullptr : measurement.find("spot_x")),
          spot_y_(kind == LengthKind::distance ? nullptr : measurement.find("spot_y")) {
        check_heads_fit(measurement, heads, kind != LengthKind::distance);
        for (int i = 1; i <= measurement.beam_count(); ++i) beams_.push_back(measurement.find("d" + std::to_string(i)));
    }

    Reduced reduce(std::size_t row) const {
        return !beams_.empty() ? reduce_beam_row(row) : spot_x_ ? reduce_spot_row(row) : reduce_ideal_row(row);
    }

private:
    const HeadCalibration& head(std::size_t row) const { return heads_.of(measurement_.stations()[row].line.name()); }

    [[noreturn]] void refuse(std::size_t row, const std::string& what) const {
        throw InvalidArgument(row_name(measurement_, row) + ": " + what);
    }

    Reduced reduce_ideal_row(std::size_t row) const {
        Reduced result;
        const auto distance = raw_value(distance_, row, uncertainty_.distance);
        const auto alpha = raw_value(alpha_, row, uncertainty_.tilt);
        const auto beta = raw_value(beta_, row, uncertainty_.tilt);
        if (distance) {
            result.has_distance = true;
            result.reading.distance = distance->value;
            result.effects.push_back({distance->standard_uncertainty, 0.0, 0.0});
        }
        if (alpha && beta) {
            result.has_tilt = true;
            result.reading.alpha = alpha->value;
            result.reading.beta = beta->value;
            if (!(result.reading.tan2_phi() < 1.0)) refuse(row, "expected tilts below 45 degrees");
            result.effects.push_back({0.0, alpha->standard_uncertainty, 0.0});
            result.effects.push_back({0.0, 0.0, beta->standard_uncertainty});
        }
        return result;
    }

    Reduced reduce_spot_row(std::size_t row) const {
        Reduced result;
        const auto distance = raw_value(distance_, row, uncertainty_.distance);
        const auto x = raw_value(spot_x_, row, uncertainty_.spot);
        const auto y = raw_value(spot_y_, row, uncertainty_.spot);
        if (!distance) return result;  // a spot gives no tilt without a distance
        if (!x || !y) {
            result.has_distance = true;
            result.reading.distance = distance->value;
            result.effects.push_back({distance->standard_uncertainty, 0.0, 0.0});
            return result;
        }
        const HeadCalibration& calibration = head(row);
        const auto reduced =
            reduce_spot(distance->value, {x->value, y->value}, *calibration.psd_distance, calibration.spot_beam);
        if (!reduced)
            refuse(row, "no mirror gives this distance and spot with psd_distance " +
                            std::to_string(*calibration.psd_distance) + " mm");
        result.take(*reduced, {distance->standard_uncertainty, x->standard_uncertainty, y->standard_uncertainty});
        return result;
    }

    Reduced reduce_beam_row(std::size_t row) const {
        const HeadCalibration& calibration = head(row);
        std::vector<double> distances, standard_uncertainties;
        std::vector<Eigen::Vector2d> offsets;
        for (std::size_t i = 0; i < beams_.size(); ++i)
            if (const auto beam = raw_value(beams_[i], row, uncertainty_.distance)) {
                distances.push_back(beam->value);
                standard_uncertainties.push_back(beam->standard_uncertainty);
                offsets.push_back(calibration.beam_offsets[i]);
            }
        Reduced result;
        const auto reduced =
            reduce_beams(Eigen::Map<const Eigen::VectorXd>(distances.data(), Eigen::Index(distances.size())), offsets);
        if (reduced)
            result.take(*reduced, standard_uncertainties);  // otherwise too few beams are left, and the reading is lost
        return result;
    }

    const Measurement& measurement_;
    const HeadCalibrations& heads_;
    const ReadingUncertainty& uncertainty_;
    const Channel *distance_, *alpha_, *beta_, *spot_x_, *spot_y_;
    std::vector<const Channel*> beams_;
};

// Length and tilts of a point, from the reduced reading. The length is linear in the parameters only without the
// product of tilt and lever arm: L = q_z + beta q_x - alpha q_y, where q is the vector from beam origin to functional
// point.
void fill_point(PassPoint& point, const Reduced& reduced, bool is_scale_line, LengthKind kind) {
    const Reading& reading = reduced.reading;
    point.has_tilt = reduced.has_tilt;
    // A scale line is parallel to its beam: without a lever arm it needs no tilts.
    point.has_length = reduced.has_distance && (reduced.has_tilt || is_scale_line || kind == LengthKind::distance);
    Eigen::RowVector3d by_reading(1.0, 0.0, 0.0);  // of the length, by (distance, alpha, beta)
    double length = reading.distance;
    if (kind == LengthKind::lever_arm_corrected) {
        length = reading.beam_length() - reading.beta * point.lateral.x() + reading.alpha * point.lateral.y();
        by_reading << 1.0 - reading.tan2_phi(), -2.0 * reading.distance * reading.alpha + point.lateral.y(),
            -2.0 * reading.distance * reading.beta - point.lateral.x();
    }
    if (point.has_length) point.reading[0] = length - point.travel;
    if (point.has_tilt) point.reading.tail<2>() << reading.alpha, reading.beta;
    for (Eigen::Vector3d effect : reduced.effects) {
        effect[0] = point.has_length ? by_reading * effect : 0.0;
        point.effects.push_back(effect);
    }
}

}  // namespace

Eigen::Vector3d PassPoint::variance() const {
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();
    for (const auto& effect : effects) variance += effect.cwiseAbs2();
    return variance;
}

std::vector<Pass> collect_passes(const Measurement& measurement, const Plan& plan, const HeadCalibrations& heads,
                                 const ReadingUncertainty& uncertainty, LengthKind kind,
                                 const std::optional<KnownExpansion>& expansion) {
    check_uncertainty(uncertainty);
    std::vector<Eigen::Vector3d> temperature;
    if (expansion) {
        check(*expansion);
        temperature = scale_temperatures(measurement, expansion->temperature);
    }
    const Reducer reducer(measurement, heads, uncertainty, kind);
    const auto rows = rows_by_pass(measurement);

    std::vector<Pass> passes;
    int readings = 0;
    for (const auto& entry : rows) {
        const std::vector<std::size_t>& members = entry.second;
        const Line line = measurement.stations()[members.front()].line;
        const auto planned = planned_points(measurement, members.front(), plan);
        Pass pass{line, plan.is_scale_line(line), plan.frame(line), {}, readings};
        for (const PlanPoint& point : planned) {
            pass.place.push_back(point.is_check ? std::nullopt : std::optional(int(pass.points.size())));
            if (!point.is_check) pass.points.emplace_back().plan = point;
        }
        const Eigen::Vector3d start = planned.front().commanded;
        for (const std::size_t row : members) {
            const Station& station = measurement.stations()[row];
            check_station(measurement, row, planned, plan);
            if (!pass.place[station.point]) continue;
            PassPoint& point = pass.points[*pass.place[station.point]];
            // The position in the file only identifies the point, because it may have been rounded when it was written.
            const Eigen::Vector3d travel = pass.frame.transpose() * (planned[station.point].commanded - start);
            point.lateral = travel.head<2>();
            point.travel = travel.z();
            if (expansion)
                point.travel += pass.direction().dot(
                    expansion->expansion.shift(planned[station.point].commanded, temperature[row]));
            fill_point(point, reducer.reduce(row), pass.is_scale_line, kind);
        }
        readings += int(pass.points.size());
        passes.push_back(std::move(pass));
    }
    return passes;
}

std::array<AxisSteps, 3> collect_steps(const std::vector<Pass>& passes, const Plan& plan) {
    std::array<AxisSteps, 3> steps;
    for (auto& axis : steps) axis.resize(plan.steps());
    for (std::size_t v = 0; v < passes.size(); ++v) {
        if (passes[v].is_scale_line) continue;
        for (std::size_t k = 0; k + 1 < passes[v].points.size(); ++k) {
            const PlanPoint &from = passes[v].points[k].plan, &to = passes[v].points[k + 1].plan;
            const int axis = index(*to.moved);
            steps[axis][std::min(from.node[axis], to.node[axis])].push_back(
                {int(v), int(k), to.node[axis] > from.node[axis] ? 1.0 : -1.0});
        }
    }
    return steps;
}

}  // namespace stepdiag
