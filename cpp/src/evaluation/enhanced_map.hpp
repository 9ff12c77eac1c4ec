// The linear map of the enhanced evaluation (stepdiag/evaluation/enhanced.hpp): tilts -> rotations -> lengths corrected
// for the rotations -> slopes -> translations. Internal.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "evaluation/slope_system.hpp"
#include "stepdiag/machine/machine.hpp"

namespace stepdiag {

class EnhancedMap {
public:
    EnhancedMap(const std::vector<Pass>& passes, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool)
        : passes_(passes), layout_{plan.steps() + 1} {
        const auto steps = collect_steps(passes, plan);
        angles_ = make_angle_systems(passes, steps, plan);
        find_angular_contributions(chain, tool, plan);
        lengths_ = make_length_systems(passes, steps, plan, usable_);
        slopes_ = make_slope_system(passes, plan, lengths_, usable_);
        find_shapes_that_hang_on_laser_angles(plan);
    }

    const AxisSystem& angles(Axis axis) const { return angles_[index(axis)]; }
    const AxisSystem& lengths(Axis axis) const { return lengths_[index(axis)]; }

    bool is_determined(FunctionId id) const {
        const int component = static_cast<int>(id.component);
        return id.is_rotation() ? angles_[index(id.axis)].determined[component - 3]
                                : lengths_[index(id.axis)].determined[component] && !is_bent(id);
    }
    bool is_slope_determined(FunctionId id) const { return !id.is_positioning() || slopes_.determines_scale(id.axis); }
    bool is_determined(Squareness s) const { return slopes_.determines(s); }

    // Whether a translation is known at every step, but its shape depends on laser angles that are undetermined because
    // readings were lost.
    bool is_bent(FunctionId id) const {
        return !id.is_rotation() && bent_[index(id.axis)][static_cast<int>(id.component)];
    }

    template <class Number>
    std::vector<Number> apply(const ReadingRows<Number>& readings) const {
        std::vector<Number> out(layout_.size(), Number::Zero());
        if (readings.has_tilts) solve_angles(readings, out);
        std::vector<Number> lengths = corrected_lengths(readings, out);
        const std::vector<Number> slopes = slopes_.solve<Number>(lengths);
        slopes_.correct_for_laser_angles<Number>(slopes, passes_, lengths);
        solve_lengths(lengths, slopes, out);
        return out;
    }

    // Sums of readings whose expectation is 0, where there are more tilts, lengths and trends than needed. Those of
    // lengths and trends are correlated.
    template <class Number>
    std::vector<Number> contradictions(const ReadingRows<Number>& readings, Thinning& thinning) const {
        std::vector<Number> out, angles(layout_.size(), Number::Zero());
        for (const Axis axis : all_axes)
            add_contradictions<Number>(angles_[index(axis)], readings.values, {1, 2}, passes_, thinning, out);
        if (readings.has_tilts) solve_angles(readings, angles);
        std::vector<Number> lengths = corrected_lengths(readings, angles);
        slopes_.add_contradictions<Number>(lengths, thinning, out);
        slopes_.correct_for_laser_angles<Number>(slopes_.solve<Number>(lengths), passes_, lengths);
        std::vector<Number> corrected(readings.values.size(), Number::Zero());
        for (std::size_t i = 0; i < lengths.size(); ++i) corrected[values_per_reading * i] = lengths[i];
        for (const Axis axis : all_axes)
            add_contradictions<Number>(lengths_[index(axis)], corrected, {0}, passes_, thinning, out);
        return out;
    }

private:
    // The rotation of a node times `coefficient` changes the length of a reading.
    struct AngularContribution {
        int row;  // among the parameters
        double coefficient;
    };

    // n . (theta_a x L_a) = theta_a . (L_a x n), for every reading. A pass whose lengths depend on undetermined
    // rotations is not usable.
    void find_angular_contributions(const Chain& chain, const Eigen::Vector3d& tool, const Plan& plan) {
        const double negligible = 1e-12 * (plan.volume().norm() + tool.norm());
        for (const Pass& pass : passes_) {
            bool usable = true;
            for (const PassPoint& point : pass.points) {
                contributions_.emplace_back();
                for (const Axis axis : all_axes) {
                    const int node = point.plan.node[index(axis)];
                    const Eigen::Vector3d lever =
                        angular_lever(chain, tool, axis, point.plan.commanded).cross(pass.direction());
                    for (int c = 0; node > 0 && c < 3; ++c) {
                        if (std::abs(lever[c]) <= negligible) continue;
                        usable = usable && angles_[index(axis)].determined[c];
                        contributions_.back().push_back(
                            {layout_.row(FunctionId{axis, Component(c + 3)}.index(), node), lever[c]});
                    }
                }
            }
            usable_.push_back(usable);
        }
    }

    // An undetermined laser angle adds a straight line to each axis and component. It disappears with the trend, unless
    // a line was lost on some of the intervals: then the shape is undetermined, too.
    void find_shapes_that_hang_on_laser_angles(const Plan& plan) {
        const double negligible = 1e-9 * plan.volume().norm();
        for (Eigen::Index j = 0; j < slopes_.null_space().cols(); ++j) {
            std::vector<Row<1>> slopes, lengths(contributions_.size(), Row<1>::Zero());
            for (const double unknown : slopes_.null_space().col(j)) slopes.push_back(Row<1>(unknown));
            slopes_.correct_for_laser_angles<Row<1>>(slopes, passes_, lengths);
            std::vector<Row<1>> out(layout_.size(), Row<1>::Zero());
            for (const Axis axis : all_axes) {
                const auto functions = functions_of<Row<1>>(out, layout_, axis, Component::X);
                add_up_steps<Row<1>>(lengths_[index(axis)], lengths, passes_, -1, functions);
                for (int c = 0; c < 3; ++c) {
                    take_off_trend<Row<1>>(functions[c], layout_.nodes, functions[c][layout_.nodes - 1]);
                    for (int k = 0; k < layout_.nodes; ++k)
                        if (std::abs(functions[c][k][0]) > negligible) bent_[index(axis)][c] = true;
                }
            }
        }
    }

    template <class Number>
    void solve_angles(const ReadingRows<Number>& readings, std::vector<Number>& out) const {
        for (const Axis axis : all_axes) {
            const auto theta = functions_of<Number>(out, layout_, axis, Component::A);
            const auto& intervals = angles_[index(axis)].intervals;
            for (std::size_t i = 0; i < intervals.size(); ++i) {
                for (int c = 0; c < 3; ++c) {
                    theta[c][i + 1] = theta[c][i];
                    for (const auto& [reading, channel, coefficient] : intervals[i].bridge[c])
                        theta[c][i + 1] += coefficient * readings.values[values_per_reading * reading + channel];
                }
                for (std::size_t s = 0; !intervals[i].is_bridged && s < intervals[i].steps.size(); ++s) {
                    const Step& step = intervals[i].steps[s];
                    if (readings.only_pass >= 0 && readings.only_pass != step.pass) continue;
                    const Number* from =
                        &readings.values[values_per_reading * (passes_[step.pass].first_reading + step.point)];
                    const Number* to = from + values_per_reading;
                    const Number alpha = step.sign * (to[1] - from[1]), beta = step.sign * (to[2] - from[2]);
                    const auto& inverse = intervals[i].solution->pseudoinverse;
                    for (int c = 0; c < 3; ++c)
                        theta[c][i + 1] +=
                            inverse(c, Eigen::Index(2 * s)) * alpha + inverse(c, Eigen::Index(2 * s + 1)) * beta;
                }
            }
        }
    }

    template <class Number>
    std::vector<Number> corrected_lengths(const ReadingRows<Number>& readings, const std::vector<Number>& theta) const {
        std::vector<Number> lengths(contributions_.size());
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            Number length = readings.values[values_per_reading * i];
            if (readings.has_tilts)
                for (const auto& [row, coefficient] : contributions_[i]) length -= coefficient * theta[row];
            lengths[i] = length;
        }
        return lengths;
    }

    // Shapes from the steps, slopes from the slope system. Straightnesses end at 0 by the choice of frame.
    template <class Number>
    void solve_lengths(const std::vector<Number>& lengths, const std::vector<Number>& slopes,
                       std::vector<Number>& out) const {
        for (const Axis axis : all_axes) {
            const auto functions = functions_of<Number>(out, layout_, axis, Component::X);
            add_up_steps<Number>(lengths_[index(axis)], lengths, passes_, -1, functions);
            for (int c = 0; c < 3; ++c) {
                Number trend = functions[c][layout_.nodes - 1];
                if (c == index(axis) && slopes_.determines_scale(axis)) trend -= slopes[SlopeSystem::scale(axis)];
                take_off_trend<Number>(functions[c], layout_.nodes, trend);
            }
        }
        for (const Squareness s : all_squarenesses) out[layout_.row(s)] = slopes[SlopeSystem::squareness(s)];
    }

    const std::vector<Pass>& passes_;
    ParameterLayout layout_;
    AxisSystems angles_;
    AxisSystems lengths_;
    std::vector<std::vector<AngularContribution>> contributions_;  // for each reading
    std::vector<bool> usable_;                                     // for each pass: whether its lengths are usable
    SlopeSystem slopes_;
    std::array<std::array<bool, 3>, 3> bent_{};  // for each axis and component of translation
};

}  // namespace stepdiag
