#include "adjustment/adjustment_problem.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "adjustment/setup_priors.hpp"
#include "evaluation/measurement_rows.hpp"
#include "measurement/records.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/measurement/reading.hpp"

namespace stepdiag {
namespace {

HeadLayout kind_of(const Measurement& measurement) {
    if (measurement.beam_count() > 0) return HeadLayout::multi_beam;
    return measurement.find("spot_x") ? HeadLayout::psd : HeadLayout::ideal;
}

std::string channel_name(HeadLayout kind, int channel) {
    if (kind == HeadLayout::multi_beam) return "d" + std::to_string(channel + 1);
    constexpr const char* names[2][3] = {{"distance", "alpha", "beta"}, {"distance", "spot_x", "spot_y"}};
    return names[kind == HeadLayout::psd][channel];
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

// The angle of the mirror against the beam by this row, rad; none where a channel of it is lost. A spot tells it by its
// change since another row, which has no zero offset.
std::optional<double> tilt_of(const Measurement& measurement, std::size_t row, std::size_t other,
                              const HeadCalibration& head) {
    const auto value = [&](const char* channel, std::size_t at) -> std::optional<double> {
        const Channel* found = measurement.find(channel);
        return found ? found->value[at] : std::nullopt;
    };
    if (const int beams = measurement.beam_count(); beams > 0) {
        Eigen::VectorXd distances(beams);
        for (int i = 0; i < beams; ++i) {
            const auto read = value(("d" + std::to_string(i + 1)).c_str(), row);
            if (!read) return std::nullopt;
            distances[i] = *read;
        }
        const auto reduced = reduce_beams(distances, head.beam_offsets);
        return reduced ? std::optional(Eigen::Vector2d(reduced->reading.alpha, reduced->reading.beta).norm())
                       : std::nullopt;
    }
    if (!measurement.find("spot_x")) {
        const auto alpha = value("alpha", row), beta = value("beta", row);
        return alpha && beta ? std::optional(Eigen::Vector2d(*alpha, *beta).norm()) : std::nullopt;
    }
    std::array<double, 3> change{};
    for (int c = 0; c < 3; ++c) {
        const char* channel = std::array{"distance", "spot_x", "spot_y"}[c];
        const auto here = value(channel, row), there = value(channel, other);
        if (!here || !there) return std::nullopt;
        change[c] = *here - *there;
    }
    if (change[0] == 0.0) return std::nullopt;
    return Eigen::Vector2d(change[1], change[2]).norm() / (2.0 * std::abs(change[0]));
}

// By the line's first point. Where its last one differs by more than machines turn, one of them is wrong, and the
// smaller counts. Rounded, so that noise has no part in a prior.
double usual_tilt(const Measurement& measurement, const std::vector<std::size_t>& rows, const HeadCalibration& head) {
    constexpr double step = 50e-6, most = 500e-6;
    // Whatever the order of the rows; of several runs the first one's, forward.
    const auto earlier = [&](std::size_t row, std::size_t other) {
        const Station &here = measurement.stations()[row], &there = measurement.stations()[other];
        return std::tie(here.run, here.direction) < std::tie(there.run, there.direction);
    };
    std::size_t near = rows.front(), far = rows.front();
    for (const std::size_t row : rows) {
        const auto point = [&](std::size_t of) { return measurement.stations()[of].point; };
        if (point(row) < point(near) || (point(row) == point(near) && earlier(row, near))) near = row;
        if (point(row) > point(far) || (point(row) == point(far) && earlier(row, far))) far = row;
    }
    const auto first = tilt_of(measurement, near, far, head), last = tilt_of(measurement, far, near, head);
    double tilt = first.value_or(last.value_or(0.0));
    if (first && last && std::abs(*first - *last) > most) tilt = std::min(*first, *last);
    return std::min(1.0, step * std::round(tilt / step));
}

// On all of the line's runs.
LineReadings line_readings(const Measurement& measurement, const Line& line, const Plan& plan,
                           const HeadCalibration& head) {
    const Channel* time = measurement.find("time");
    std::vector<const Channel*> tilts;
    for (const char* name : {"alpha", "beta", "spot_x", "spot_y"})
        if (const Channel* channel = measurement.find(name)) tilts.push_back(channel);
    LineReadings readings{measurement.beam_count() > 0, time != nullptr, {}};
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < measurement.size(); ++row) {
        if (!(measurement.stations()[row].line == line)) continue;
        rows.push_back(row);
        for (const Channel* tilt : tilts) readings.tilts = readings.tilts || tilt->value[row].has_value();
        readings.times = readings.times && time->value[row].has_value();
    }
    readings.tilt = usual_tilt(measurement, rows, head);
    const LateralExcursion beside = plan.lateral_excursion(line);
    const double rounding = 1e-12 * plan.volume().norm();
    for (int c = 0; c < 2; ++c) readings.beside[c] = beside.highest[c] - beside.lowest[c] > rounding;
    return readings;
}

// Where no point stands beside a line, only priors know how laser and mirror stand there. Their difference has twice
// the variance of either; where the tilts of such lines show more than is usual, that is what both are taken for.
double usual_angle(const Plan& plan, const std::map<std::string, LineReadings>& told) {
    const double usual = record(SetupQuantity::laser).usual;
    double squares = 0.0;
    int count = 0;
    for (const auto& [line, readings] : told) {
        const bool alone = !readings.beside[0] || !readings.beside[1];
        if (plan.is_scale_line(Line::parse(line)) || !readings.tilts || !alone) continue;
        squares += readings.tilt * readings.tilt;  // of two components
        ++count;
    }
    return count == 0 ? usual : std::max(usual, std::sqrt(squares / (4.0 * count)));
}

// By how much two readings that determine the same thing may differ in their uncertainties, so that the normal
// equations still tell what only the worse one says from what none does (gauss_newton.hpp): measured, with 8 and 50
// steps, three heads.
constexpr double widest_weights = 3e4;
// Of beams with unknown constants: with more, steps crawl along a valley, and compilers decide whether they arrive.
constexpr double widest_weights_of_beams = 2.3e4;

// Beams whose constants are unknown say nothing of the mean tilt: that is known as well as the laser is, or on scale
// lines, where the laser is no unknown, as the mirror.
double weighable_beam(const LineSetup& setup) {
    const std::vector<Eigen::Vector2d>& beams = setup.model.head().beam_offsets;
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& beam : beams) centre += beam / double(beams.size());
    double arm = 0.0;
    bool unknown = false;
    for (std::size_t i = 0; i < beams.size(); ++i) {
        arm = std::max(arm, (beams[i] - centre).norm());
        unknown = unknown || setup.prior[setup::beam_constants + int(i)] != fixed_unknown;
    }
    const int angle = setup.is_scale_line ? setup::reflector : setup::laser;
    const PriorUncertainty known = std::max(setup.prior[angle], setup.prior[angle + 1]);
    if (!unknown || known == fixed_unknown) return 0.0;
    return std::min(known, record(SetupQuantity::laser).usual) * arm / widest_weights_of_beams;
}

}  // namespace

AdjustmentProblem::AdjustmentProblem(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                     const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                     const AdjustmentOptions& options, Elimination elimination)
    : plan_(plan),
      chain_(chain),
      tool_(tool),
      heads_(std::make_shared<const HeadCalibrations>(heads)),
      kind_(kind_of(measurement)),
      rotations_(options.rotations),
      expansion_(options.expansion) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    check_uncertainty(options.uncertainty);
    if (expansion_) check(*expansion_);
    check_heads_fit(measurement, heads, true);
    for (auto& list : node_at_) list.assign(plan.steps() + 1, no_unknown);
    for (const Station& station : measurement.stations())
        reversal_ = reversal_ || (options.reversal && station.direction == Direction::backward);
    collect_setups(measurement, options);
    collect_points(measurement, options);
    round_uncertainties();
    number_unknowns(options, elimination);
}

// A set-up serves a forward run of a line and the backward runs that follow it, or all runs of the line.
void AdjustmentProblem::collect_setups(const Measurement& measurement, const AdjustmentOptions& options) {
    setup_of_row_.resize(measurement.size());
    std::map<std::string, int> current;  // set-up by line
    std::map<std::string, LineReadings> told;
    for (const Station& station : measurement.stations())
        if (const std::string line = station.line.name(); plan_.contains(station.line) && told.count(line) == 0)
            told.emplace(line, line_readings(measurement, station.line, plan_, heads_->of(line)));
    const double usual =
        kind_ == HeadLayout::multi_beam ? record(SetupQuantity::laser).usual : usual_angle(plan_, told);
    for (auto& entry : told) entry.second.usual_angle = usual;
    for (const auto& entry : rows_by_pass(measurement)) {
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
            setup.prior = setup_priors(options, line.name(), scale, told.at(line.name()), setup.model);
            setup.unknown.assign(setup.prior.size(), no_unknown);
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
    std::vector<Eigen::Vector3d> temperature;
    if (expansion_) {
        temperature = scale_temperatures(measurement, expansion_->temperature);
        sensors_ = sensor_groups(measurement, *expansion_);
    }
    std::vector<double> drifted;
    if (options.machine_drift) drifted = since_first_reading(measurement, options.machine_drift->record);
    std::vector<std::string> names;
    for (int c = 0; c < std::max(3, measurement.beam_count()); ++c) names.push_back(stepdiag::channel_name(kind_, c));
    for (std::size_t row = 0; row < measurement.size(); ++row) {
        const Station& station = measurement.stations()[row];
        const auto place = planned.try_emplace({station.line.name(), plan_.order(station.run)});
        if (place.second) place.first->second = planned_points(measurement, row, plan_);
        const std::vector<PlanPoint>& line = place.first->second;
        check_station(measurement, row, line, plan_);

        const LineSetup& setup = setups_[setup_of_row_[row]];
        AdjustedPoint point{setup_of_row_[row], {no_unknown, no_unknown, no_unknown}, {}, {}, int(readings_.size()), 0};
        for (int c = 0; c < int(names.size()); ++c)
            if (const auto raw =
                    raw_value(measurement.find(names[c]), row, usual_uncertainty(options.uncertainty, names[c])))
                readings_.push_back({row, c, usable(*raw, measurement, row, names[c]), raw->standard_uncertainty,
                                     raw->standard_uncertainty});
        point.end_reading = int(readings_.size());
        if (point.end_reading == point.first_reading) continue;

        const PlanPoint& target = line[station.point];
        point.place.commanded = target.commanded;
        point.place.travel = plan_.frame(station.line).col(2).dot(target.commanded - line.front().commanded);
        if (setup.first_time) point.place.time = *time->value[row] - *setup.first_time;
        if (!drifted.empty()) point.place.drifted = drifted[row];
        if (expansion_) {
            point.place.from_fixed = target.commanded - expansion_->expansion.fixed_point;
            point.place.stretch = expansion_->expansion.stretch(target.commanded, temperature[row]);
        }
        for (const Axis axis : all_axes) {
            const int sign = station.line.sign(axis) * (station.direction == Direction::backward ? -1 : 1);
            const bool negative = reversal_ && sign < 0;
            point.negative[index(axis)] = sign < 0;
            if (target.node[index(axis)] > 0 || negative)
                point.node[index(axis)] = node_index(axis, target.node[index(axis)], negative);
        }
        points_.push_back(point);
    }
}

// Readings are not known better than their numbers are rounded, and count for no more than the solution can bear.
void AdjustmentProblem::round_uncertainties() {
    const double reach = plan_.volume().norm() + tool_.norm();
    const int channels = setups_.empty() ? 0 : setups_.front().model.channels();
    const auto longest = [&](const AdjustedPoint& point) {
        const HeadCalibration& head = setups_[point.setup].model.head();
        return reach + head.standoff + head.psd_distance.value_or(0.0);
    };
    const auto is_distance = [&](int channel) { return kind_ == HeadLayout::multi_beam || channel == 0; };
    double tilts = 0.0;  // rad: sum of the uncertainties of tilts
    int count = 0;
    for (const AdjustedPoint& point : points_)
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            if (is_distance(readings_[r].channel)) continue;
            tilts += readings_[r].standard_uncertainty / (kind_ == HeadLayout::psd ? 2.0 * longest(point) : 1.0);
            ++count;
        }
    double beams = 0.0;  // mm, of all lines: they are weighed against each other, too
    if (kind_ == HeadLayout::multi_beam)
        for (const LineSetup& setup : setups_) beams = std::max(beams, weighable_beam(setup));
    for (int c = 0; c < channels; ++c) {
        std::vector<double> values, planned;
        for (const AdjustedPoint& point : points_)
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                if (readings_[r].channel != c) continue;
                values.push_back(readings_[r].value);
                const double nominal = setups_[point.setup].model.head().standoff + point.place.travel;
                planned.push_back(is_distance(c) ? nominal : 0.0);
            }
        const double step = decimal_step(values, planned, kind_ == HeadLayout::ideal && c > 0 ? 1e-6 : 1.0);
        RoundedChannel rounded{stepdiag::channel_name(kind_, c), 0.0, 0.0, step, RoundingCause::doubles};
        for (const AdjustedPoint& point : points_)
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                AdjustedReading& reading = readings_[r];
                if (reading.channel != c) continue;
                reading.of_doubles = double_rounding(kind_, c, longest(point));
                reading.rounding = std::max(reading.of_doubles, step / std::sqrt(12.0));
                double least = std::max(reading.rounding, beams);
                reading.noise = std::max(reading.noise, reading.rounding);
                if (c == 0 && count > 0) least = std::max(least, tilts / count * longest(point) / widest_weights);
                if (!(reading.standard_uncertainty < least)) continue;
                rounded.stated = reading.standard_uncertainty;
                rounded.used = reading.standard_uncertainty = least;
                rounded.cause = least > reading.rounding                ? RoundingCause::weights
                                : reading.rounding > reading.of_doubles ? RoundingCause::decimals
                                                                        : RoundingCause::doubles;
            }
        if (rounded.used > 0.0) rounded_.push_back(rounded);
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
    if (expansion_)
        for (int a = 0; a < 3; ++a) errors[a][a] += expansion_->expansion.coefficient[a] * point.place.stretch[a];
    for (const CoefficientUnknown& of : coefficients_)
        for (const int a : of.axes) errors[a][a] += x[of.unknown] * of.effect(point.place, a);
    return errors;
}

Eigen::VectorXd AdjustmentProblem::setup_values(const LineSetup& setup, const Eigen::VectorXd& x) const {
    Eigen::VectorXd values = Eigen::VectorXd::Zero(Eigen::Index(setup.unknown.size()));
    for (const int c : setup.active) values[c] = x[setup.unknown[c]];
    return values;
}

// --- order and weight of the unknowns ---

namespace {

constexpr int largest_border = 10'000;  // a dense matrix of them: 800 MB, minutes

// The frame choice: straightnesses that are 0 at the end of travel and have no squareness to take their slope.
bool is_zero_at_end(Axis axis, int component) {
    const FunctionId id{axis, Component(component)};
    if (!id.is_straightness()) return false;
    return std::none_of(all_squarenesses.begin(), all_squarenesses.end(), [&](Squareness s) {
        return squareness_term(s).axis == axis && squareness_term(s).component == component;
    });
}

}  // namespace

void AdjustmentProblem::number_unknowns(const AdjustmentOptions& options, Elimination elimination) {
    const int blocks = number_nodes(options);
    const int first_of_set_ups = border_;
    for (LineSetup& setup : setups_)
        for (int c = 0; c < int(setup.prior.size()); ++c)
            if (setup.prior[c] != fixed_unknown) {
                setup.unknown[c] = 6 * blocks + border_++;
                setup.active.push_back(c);
            }
    if (expansion_)
        for (const AxisGroup& axes : coefficient_groups(*expansion_))
            if (const double prior = expansion_->standard_uncertainty[axes.front()]; prior > 0.0)
                coefficients_.push_back({axes, prior, false, 6 * blocks + border_++});
    if (options.machine_drift)
        for (int a = 0; a < 3; ++a)
            if (const double prior = options.machine_drift->standard_uncertainty[a]; prior > 0.0)
                coefficients_.push_back({{a}, prior, true, 6 * blocks + border_++});
    find_reach(blocks, options);
    choose_elimination(elimination, first_of_set_ups);
    sort_points();
    weigh_unknowns();
}

// Inner nodes are blocks of the band, from both ends of the axes inwards; what is left of the others is of the border.
// Returns the number of blocks.
int AdjustmentProblem::number_nodes(const AdjustmentOptions& options) {
    const int steps = plan_.steps();
    std::vector<int> banded;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
        if (nodes_[i].node > 0 && nodes_[i].node < steps) banded.push_back(int(i));
    const auto fold = [&](int i) {
        const AxisNode& n = nodes_[i];
        return std::tuple(std::min(n.node, steps - n.node), index(n.axis), n.node, n.negative);
    };
    std::sort(banded.begin(), banded.end(), [&](int i, int j) { return fold(i) < fold(j); });
    for (std::size_t b = 0; b < banded.size(); ++b) {
        AxisNode& node = nodes_[banded[b]];
        node.block = int(b);
        for (int c = 0; c < 6; ++c)
            if (c < 3 || options.rotations) node.unknown[c] = int(6 * b) + c;
    }
    for (AxisNode& node : nodes_) {
        if (node.block != no_unknown) continue;
        for (int c = 0; c < 6; ++c)
            if ((c < 3 || options.rotations) && (node.negative || !is_zero_at_end(node.axis, c)))
                node.unknown[c] = int(6 * banded.size()) + border_++;
    }
    return int(banded.size());
}

// The last block that each block is coupled to: by readings, by both directions of approach, by smoothness.
void AdjustmentProblem::find_reach(int blocks, const AdjustmentOptions& options) {
    reach_.resize(std::size_t(blocks));
    for (std::size_t b = 0; b < reach_.size(); ++b) reach_[b] = int(b);
    const auto couple = [&](int i, int j) {
        if (i == no_unknown || j == no_unknown) return;
        const int a = nodes_[i].block, b = nodes_[j].block;
        if (a != no_unknown && b != no_unknown)
            reach_[std::min(a, b)] = std::max(reach_[std::min(a, b)], std::max(a, b));
    };
    for (const AdjustedPoint& point : points_)
        for (int a = 0; a < 3; ++a) couple(point.node[a], point.node[(a + 1) % 3]);
    for (const Axis axis : all_axes) {
        const auto &both = node_at_[2 * index(axis)], &negative = node_at_[2 * index(axis) + 1];
        for (int k = 0; k <= plan_.steps(); ++k) couple(both[k], negative[k]);
    }
    if (options.smoothness)
        for (const auto& chain : node_chains())
            for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
                couple(chain[k], chain[k + 1]);
                if (k + 2 < chain.size()) couple(chain[k], chain[k + 2]);
            }
    for (std::size_t b = 1; b < reach_.size(); ++b) reach_[b] = std::max(reach_[b], reach_[b - 1]);
}

// By the multiplications of a factorisation.
void AdjustmentProblem::choose_elimination(Elimination elimination, int first_of_set_ups) {
    constexpr double clearly = 0.5;  // cheaper, so that a single run keeps its band
    int of_set_ups = 0;
    for (const LineSetup& setup : setups_) of_set_ups += int(setup.active.size());
    double set_ups_last = std::pow(double(border_), 3) / 3.0;
    for (int b = 0; b < blocks(); ++b) set_ups_last += 6.0 * std::pow(6.0 * (reach_[b] - b) + border_, 2);
    const double rest = size() - of_set_ups;
    const double nodes_last = std::pow(rest, 3) / 3.0 + of_set_ups * rest * rest;
    if (elimination == Elimination::set_ups_last || !(nodes_last < clearly * set_ups_last)) {
        if (border_ > largest_border)
            throw InvalidArgument(
                "adjustment: " + std::to_string(setups_.size()) + " set-ups have more than " +
                std::to_string(largest_border) +
                " unknowns; where runs of a line have one set-up in common, say so (one_setup_per_line)");
        return;
    }
    leaves_.first = first_of_set_ups;
    for (const LineSetup& setup : setups_) leaves_.size.push_back(int(setup.active.size()));
    leaf_unknowns_ = of_set_ups;
    std::fill(reach_.begin(), reach_.end(), blocks() - 1);
}

void AdjustmentProblem::weigh_unknowns() {
    constexpr double metre = 1e3;                                 // mm
    constexpr double usual_translation = 0.1, usual_turn = 3e-4;  // of an axis, mm and rad
    prior_.assign(size(), free_unknown);
    usual_.assign(size(), usual_translation);
    change_scale_.assign(size(), 1.0 / metre);
    for (const AxisNode& node : nodes_)
        for (int c = 3; c < 6; ++c)
            if (node.unknown[c] != no_unknown) {
                usual_[node.unknown[c]] = usual_turn;
                change_scale_[node.unknown[c]] = 1.0;
            }
    for (const LineSetup& setup : setups_)
        for (const int c : setup.active) {
            const int j = setup.unknown[c];
            prior_[j] = setup.prior[c];
            const SetupQuantityRecord& of = record(setup::component(c).quantity);
            usual_[j] = of.usual;
            if (of.unit == "rad" || of.unit == "1") change_scale_[j] = 1.0;
        }
    constexpr double usual_kelvins = 10.0;  // that make a coefficient a part of lengths
    double longest = 0.0;
    for (const AdjustedPoint& point : points_) longest = std::max(longest, std::abs(point.place.drifted));
    for (const CoefficientUnknown& of : coefficients_) {
        prior_[of.unknown] = usual_[of.unknown] = of.prior;
        change_scale_[of.unknown] = of.of_drift ? longest / metre : usual_kelvins;
    }
}

void AdjustmentProblem::free_set_up(SetupQuantity quantity) {
    for (LineSetup& setup : setups_)
        for (const int c : setup.active)
            if (setup::component(c).quantity == quantity)
                prior_[setup.unknown[c]] = setup.prior[c] = record(quantity).broadest;
}

int AdjustmentProblem::informative_priors() const {
    int count = int(coefficients_.size());
    for (const LineSetup& setup : setups_)
        for (const int c : setup.active) count += setup.prior[c] < record(setup::component(c).quantity).broadest;
    std::set<int> groups;
    for (const EstimatedFault& fault : faults_)
        if (std::isfinite(fault.prior)) count += !groups.insert(fault.group).second;
    return count;
}

void AdjustmentProblem::estimate(std::vector<EstimatedFault> faults) {
    constexpr double metre = 1e3;  // mm
    border_ -= int(faults_.size());
    for (auto* list : {&prior_, &usual_, &change_scale_}) list->resize(size());
    for (EstimatedFault& fault : faults) {
        fault.unknown = size();
        ++border_;
        prior_.push_back(fault.prior);
        usual_.push_back(fault.usual);
        change_scale_.push_back(is_length(readings_[fault.pattern.readings.front()]) ? 1.0 / metre : 1.0);
    }
    faults_ = std::move(faults);
}

std::string AdjustmentProblem::noise_channel(const AdjustedReading& reading) const {
    return kind_ == HeadLayout::multi_beam ? std::string("distance") : channel_name(reading);
}

void AdjustmentProblem::weigh(const std::vector<NoiseFactor>& noise) {
    if (noise.empty()) return;
    for (const AdjustedPoint& point : points_) {
        const std::string line = setups_[point.setup].line.name();
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const std::string channel = noise_channel(readings_[r]);
            const NoiseFactor* of_reading = nullptr;
            for (const NoiseFactor& each : noise)
                if (each.channel == channel && (each.line == line || (each.line.empty() && !of_reading)))
                    of_reading = &each;
            if (!of_reading) continue;
            AdjustedReading& reading = readings_[r];
            reading.standard_uncertainty = std::max(reading.standard_uncertainty, reading.noise * of_reading->factor);
        }
    }
}

bool AdjustmentProblem::is_length(const AdjustedReading& reading) const {
    return kind_ != HeadLayout::ideal || reading.channel == 0;
}

// In the order of the band, so that who goes through the points goes through the matrix once.
void AdjustmentProblem::sort_points() {
    const auto first_block = [&](const AdjustedPoint& point) {
        int first = blocks();
        for (const int node : point.node)
            if (node != no_unknown && nodes_[node].block != no_unknown) first = std::min(first, nodes_[node].block);
        return first;
    };
    std::stable_sort(points_.begin(), points_.end(),
                     [&](const AdjustedPoint& a, const AdjustedPoint& b) { return first_block(a) < first_block(b); });
    std::vector<AdjustedReading> sorted;
    sorted.reserve(readings_.size());
    for (AdjustedPoint& point : points_) {
        const int first = int(sorted.size());
        for (int r = point.first_reading; r < point.end_reading; ++r) sorted.push_back(readings_[r]);
        point.first_reading = first;
        point.end_reading = int(sorted.size());
    }
    readings_ = std::move(sorted);
}

}  // namespace stepdiag
