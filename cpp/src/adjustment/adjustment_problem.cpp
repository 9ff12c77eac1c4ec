#include "adjustment/adjustment_problem.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "evaluation/measurement_rows.hpp"
#include "adjustment/setup_priors.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

ChannelKind kind_of(const Measurement& measurement) {
    if (measurement.beam_count() > 0) return ChannelKind::multi_beam;
    return measurement.find("spot_x") ? ChannelKind::psd : ChannelKind::ideal;
}

std::string channel_name(ChannelKind kind, int channel) {
    if (kind == ChannelKind::multi_beam) return "d" + std::to_string(channel + 1);
    constexpr const char* names[2][3] = {{"distance", "alpha", "beta"}, {"distance", "spot_x", "spot_y"}};
    return names[kind == ChannelKind::psd][channel];
}

double usual_uncertainty(const ReadingUncertainty& uncertainty, const std::string& channel) {
    if (channel.front() == 'd') return uncertainty.distance;
    return channel.front() == 's' ? uncertainty.spot : uncertainty.tilt;
}

Direction direction_of(const Measurement& measurement, const std::vector<std::size_t>& rows) {
    const Direction direction = measurement.stations()[rows.front()].direction;
    for (const std::size_t row : rows)
        if (measurement.stations()[row].direction != direction)
            throw InvalidArgument(row_name(measurement, row) +
                                  ": expected the direction of the run's other readings on this line");
    return direction;
}

// A mirror that is turned by 45 degrees sends no beam back to its head.
double usable(const RawValue& raw, const Measurement& measurement, std::size_t row, const std::string& channel) {
    const bool tilt = channel == "alpha" || channel == "beta";
    if (tilt && !(std::abs(raw.value) < 1.0))
        throw InvalidArgument(row_name(measurement, row) + ": expected tilts below 45 degrees");
    return raw.value;
}

bool has_tilts(const Measurement& measurement) {
    return measurement.find("alpha") != nullptr || measurement.find("spot_x") != nullptr;
}

}  // namespace

AdjustmentProblem::AdjustmentProblem(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                     const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                     const AdjustmentOptions& options)
    : plan_(plan),
      chain_(chain),
      tool_(tool),
      heads_(std::make_shared<const HeadCalibrations>(heads)),
      kind_(kind_of(measurement)),
      rotations_(options.rotations) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    check_uncertainty(options.uncertainty);
    check_heads_fit(measurement, heads, true);
    for (auto& list : node_at_) list.assign(plan.steps() + 1, no_unknown);
    for (const Station& station : measurement.stations())
        reversal_ = reversal_ || (options.reversal && station.direction == Direction::backward);
    collect_setups(measurement, options);
    collect_points(measurement, options);
    number_unknowns(options);
}

// A set-up serves a forward run of a line and the backward runs that follow it, or all runs of the line.
void AdjustmentProblem::collect_setups(const Measurement& measurement, const AdjustmentOptions& options) {
    setup_of_row_.resize(measurement.size());
    std::map<std::string, int> current;  // set-up by line
    for (const auto& entry : rows_by_visit(measurement)) {
        const std::vector<std::size_t>& rows = entry.second;
        const Line line = measurement.stations()[rows.front()].line;
        const bool backward = direction_of(measurement, rows) == Direction::backward;
        const auto found = current.find(line.name());
        if (found == current.end() || !(backward || options.one_setup_per_line)) {
            const HeadCalibration& head = heads_->of(line.name());
            const auto planned = planned_points(measurement, rows.front(), plan_);
            const Eigen::Matrix3d frame = plan_.frame(line);
            const bool scale = plan_.is_scale_line(line);
            const Eigen::Vector3d origin = planned.front().commanded + tool_ - head.standoff * frame.col(2);
            LineSetup setup{entry.first.first, line, scale, ChannelModel(kind_, head, frame, origin), {}, {}, {}};
            const int columns = setup.model.setup_size();
            setup.prior = setup_priors(options, line.name(), scale, line.moved_axes() == 1,
                                       kind_ == ChannelKind::multi_beam || has_tilts(measurement), kind_, columns);
            setup.unknown.assign(columns, no_unknown);
            current[line.name()] = int(setups_.size());
            setups_.push_back(std::move(setup));
        }
        for (const std::size_t row : rows) setup_of_row_[row] = current[line.name()];
    }
    const Channel* time = measurement.find("time");
    for (std::size_t row = 0; row < measurement.size(); ++row) {
        LineSetup& setup = setups_[setup_of_row_[row]];
        if (setup.prior[setup::drift] == fixed_unknown) continue;
        if (!time || !time->value[row])
            throw InvalidArgument(row_name(measurement, row) +
                                  ": a drift that is not fixed needs the time of every reading (column time_s)");
        setup.first_time = std::min(setup.first_time.value_or(*time->value[row]), *time->value[row]);
    }
}

int AdjustmentProblem::node_index(Axis axis, int node, bool negative) {
    int& place = node_at_[2 * index(axis) + negative][node];
    if (place == no_unknown) {
        place = int(nodes_.size());
        nodes_.push_back({axis, node, negative, plan_.node_position(axis, node)});
    }
    return place;
}

void AdjustmentProblem::collect_points(const Measurement& measurement, const AdjustmentOptions& options) {
    std::map<std::pair<std::string, StepOrder>, std::vector<PlanPoint>> planned;
    const Channel* time = measurement.find("time");
    std::vector<std::string> names;
    for (int c = 0; c < std::max(3, measurement.beam_count()); ++c) names.push_back(stepdiag::channel_name(kind_, c));
    for (std::size_t row = 0; row < measurement.size(); ++row) {
        const Station& station = measurement.stations()[row];
        const auto place = planned.try_emplace({station.line.name(), plan_.order(station.run)});
        if (place.second) place.first->second = planned_points(measurement, row, plan_);
        const std::vector<PlanPoint>& line = place.first->second;
        check_station(measurement, row, line);

        const LineSetup& setup = setups_[setup_of_row_[row]];
        // Without a reflector angle of their own the tilts of a scale line would be taken for the machine's.
        const bool distance_only =
            setup.is_scale_line && kind_ != ChannelKind::multi_beam && setup.prior[setup::reflector] == fixed_unknown;
        AdjustedPoint point{setup_of_row_[row], {no_unknown, no_unknown, no_unknown}, {}, int(readings_.size()), 0};
        for (int c = 0; c < int(names.size()) && !(distance_only && c > 0); ++c)
            if (const auto raw =
                    raw_value(measurement.find(names[c]), row, usual_uncertainty(options.uncertainty, names[c])))
                readings_.push_back({row, c, usable(*raw, measurement, row, names[c]), raw->standard_uncertainty});
        point.end_reading = int(readings_.size());
        if (point.end_reading == point.first_reading) continue;

        const PlanPoint& target = line[station.point];
        point.place.commanded = target.commanded;
        point.place.travel = plan_.frame(station.line).col(2).dot(target.commanded - line.front().commanded);
        if (setup.first_time) point.place.time = *time->value[row] - *setup.first_time;
        for (const Axis axis : all_axes) {
            const int sign = station.line.sign(axis) * (station.direction == Direction::backward ? -1 : 1);
            const bool negative = reversal_ && sign < 0;
            if (target.node[index(axis)] > 0 || negative)
                point.node[index(axis)] = node_index(axis, target.node[index(axis)], negative);
        }
        points_.push_back(point);
    }
}

std::string AdjustmentProblem::channel_name(const AdjustedReading& reading) const {
    return stepdiag::channel_name(kind_, reading.channel);
}

std::vector<std::vector<int>> AdjustmentProblem::node_chains() const {
    std::vector<std::vector<int>> chains;
    for (const auto& list : node_at_) {
        auto& chain = chains.emplace_back();
        for (const int node : list)
            if (node != no_unknown) chain.push_back(node);
    }
    return chains;
}

const AxisNode* AdjustmentProblem::find(Axis axis, int node, bool negative) const {
    const int place = node_at_[2 * index(axis) + negative][node];
    return place == no_unknown ? nullptr : &nodes_[place];
}

MachineErrors AdjustmentProblem::errors(const AdjustedPoint& point, const Eigen::VectorXd& x) const {
    MachineErrors errors;
    for (int a = 0; a < 3; ++a) {
        errors[a].setZero();
        if (point.node[a] == no_unknown) continue;
        const AxisNode& node = nodes_[point.node[a]];
        for (int c = 0; c < 6; ++c)
            if (node.unknown[c] != no_unknown) errors[a][c] = x[node.unknown[c]];
    }
    return errors;
}

Eigen::VectorXd AdjustmentProblem::setup_values(const LineSetup& setup, const Eigen::VectorXd& x) const {
    Eigen::VectorXd values = Eigen::VectorXd::Zero(Eigen::Index(setup.unknown.size()));
    for (const int c : setup.active) values[c] = x[setup.unknown[c]];
    return values;
}

}  // namespace stepdiag
