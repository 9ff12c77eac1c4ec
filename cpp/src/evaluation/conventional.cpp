#include "stepdiag/evaluation/conventional.hpp"

#include <algorithm>

#include "evaluation/linear_evaluation.hpp"
#include "evaluation/linear_maps.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Distances -> translations, summed from home; the frame is then turned so that EYX, EZX and EZY have no slope.
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
        Number slope[3][3];  // of component c over axis a
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
        // A squareness is the angle between two axes: what their two straightness slopes have together.
        for (const Squareness s : all_squarenesses) {
            const auto [axis, component, sign] = squareness_term(s);
            out[layout_.row(s)] = sign * (slope[index(axis)][component] + slope[component][index(axis)]);
        }
        return out;
    }

private:
    const std::vector<Pass>& passes_;
    Eigen::Vector3d volume_;
    ParameterLayout layout_;
    AxisSystems systems_;
};

std::vector<bool> body_diagonals(const std::vector<Pass>& passes) {
    std::vector<bool> are;
    for (const Pass& pass : passes) are.push_back(pass.line.is_body_diagonal());
    return are;
}

}  // namespace

LinearProgram conventional_program(const std::vector<Pass>& passes, const Plan& plan) {
    return write_down(ConventionalMap(passes, plan, body_diagonals(passes)), passes, {plan.steps() + 1});
}

Calibration evaluate_conventional(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                  const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                  const EvaluationOptions& options) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    const auto passes = collect_passes(measurement, plan, heads, options.uncertainty, LengthKind::distance);
    check(options.plausible);
    refuse_foreign_distances(measurement, plan);
    if (const std::string far = far_reading(measurement, plan); !far.empty()) throw InvalidArgument(far);
    const std::vector<bool> usable = body_diagonals(passes);
    const auto diagonals = std::count(usable.begin(), usable.end(), true);
    if (diagonals < 3)
        throw InvalidArgument("conventional evaluation: expected three or four body diagonals, the measurement has " +
                              std::to_string(diagonals));

    const ConventionalMap map(passes, plan, usable);
    Calibration calibration{"conventional", chain, plan.volume(), tool, {}, {}};
    evaluate_linear(map, passes, plan, options.full_covariance, calibration);
    calibration.fit = Fit::unchecked;
    for (const Axis axis : all_axes)
        if (auto gap = map.lengths(axis).gap) {
            gap->reason = OpenReason::few_diagonals;
            if (gap->lines_read == gap->lines_planned) gap->remedies = {Remedy::three_diagonals};
            calibration.findings.push_back(*gap);
        }
    for (const Squareness s : all_squarenesses)
        if (!map.is_determined(s))
            calibration.findings.push_back(
                {OpenPart::whole, {name(s)}, OpenReason::not_seen, calibration.findings.front().remedies});
    if (!is_anything_determined(calibration)) throw NothingDetermined("conventional evaluation", calibration.findings);
    refuse_implausible(calibration, measurement, plan, options.plausible);
    calibration.findings.push_back({OpenPart::whole, {}, OpenReason::distances_alone});
    for (int i = 0; i < function_count; ++i)
        if (FunctionId::at(i).is_rotation()) calibration.findings.back().parameters.push_back(FunctionId::at(i).name());
    return calibration;
}

}  // namespace stepdiag
