// The linear map of the conventional evaluation (stepdiag/evaluation/conventional.hpp). Internal.
#pragma once

#include "evaluation/linear_evaluation.hpp"

namespace stepdiag {

// Which passes it uses.
inline std::vector<bool> body_diagonals(const std::vector<Pass>& passes) {
    std::vector<bool> are;
    for (const Pass& pass : passes) are.push_back(pass.line.is_body_diagonal());
    return are;
}

// Distances -> translations, added up from home. Then the frame is turned so that EYX, EZX and EZY have no slope.
class ConventionalMap {
public:
    ConventionalMap(const std::vector<Pass>& passes, const Plan& plan, const std::vector<bool>& usable)
        : passes_(passes),
          volume_(plan.volume()),
          layout_{plan.steps() + 1},
          systems_(make_length_systems(passes, collect_steps(passes, plan), plan, usable)) {}

    bool is_determined(FunctionId id) const {
        return !id.is_rotation() && systems_[index(id.axis)].determined[static_cast<int>(id.component)];
    }
    bool is_slope_determined(FunctionId) const { return true; }
    bool is_determined(Squareness s) const {
        const auto [axis, component, sign] = squareness_term(s);
        return systems_[index(axis)].determined[component] && systems_[component].determined[index(axis)];
    }
    const AxisSystem& lengths(Axis axis) const { return systems_[index(axis)]; }

    template <class Number>
    std::vector<Number> apply(const ReadingRows<Number>& readings) const {
        std::vector<Number> lengths(readings.values.size() / values_per_reading);
        for (std::size_t i = 0; i < lengths.size(); ++i) lengths[i] = readings.values[values_per_reading * i];
        std::vector<Number> out(layout_.size(), Number::Zero());
        Number slope[3][3];  // of component c along axis a
        for (const Axis axis : all_axes) {
            const int a = index(axis);
            const auto functions = functions_of<Number>(out, layout_, axis, Component::X);
            add_up_steps<Number>(systems_[a], lengths, passes_, readings.only_pass, functions);
            for (int c = 0; c < 3; ++c) {
                const Number end = functions[c][layout_.nodes - 1];
                slope[a][c] = end / volume_[a];
                if (c != a) take_off_trend<Number>(functions[c], layout_.nodes, end);  // positioning keeps its slope
            }
        }
        // A squareness is the angle between two axes: the sum of their two straightness slopes.
        for (const Squareness s : all_squarenesses) {
            const auto [axis, component, sign] = squareness_term(s);
            out[layout_.row(s)] = sign * (slope[index(axis)][component] + slope[component][index(axis)]);
        }
        return out;
    }

    // Sums of readings whose expectation is 0, where a step was read on more lines than needed.
    template <class Number>
    std::vector<Number> contradictions(const ReadingRows<Number>& readings, Thinning& thinning) const {
        std::vector<Number> out;
        for (const Axis axis : all_axes)
            add_contradictions<Number>(systems_[index(axis)], readings.values, {0}, passes_, thinning, out);
        return out;
    }

private:
    const std::vector<Pass>& passes_;
    Eigen::Vector3d volume_;
    ParameterLayout layout_;
    AxisSystems systems_;
};

}  // namespace stepdiag
