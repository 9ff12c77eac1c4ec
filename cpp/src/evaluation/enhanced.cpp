#include "stepdiag/evaluation/enhanced.hpp"

#include <algorithm>

#include "evaluation/enhanced_map.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// "EXY, EZY: <gap> with <readings>; <what helps>", for the components that are not determined.
std::string explain_gap(Axis axis, Component first, const AxisSystem& system, const std::string& readings,
                        const std::string& lines) {
    std::string names;
    for (int c = 0; c < 3; ++c)
        if (!system.determined[c])
            names += (names.empty() ? "" : ", ") + FunctionId{axis, Component(static_cast<int>(first) + c)}.name();
    return names + ": " + system.gap + " with " + readings + "; " +
           (system.gap_was_planned ? lines + " lines of different direction are needed at every step"
                                   : "measure the lost points again");
}

std::vector<std::string> explain(const EnhancedMap& map, const Plan& plan) {
    std::vector<std::string> sentences;
    bool readings_lost = false;
    for (const Axis axis : all_axes) {
        const AxisSystem &angles = map.angles(axis), &lengths = map.lengths(axis);
        if (!angles.gap.empty()) sentences.push_back(explain_gap(axis, Component::A, angles, "tilts", "two"));
        if (!lengths.gap.empty())
            sentences.push_back(explain_gap(axis, Component::X, lengths, "distance, tilts and known angles", "three"));
        readings_lost = readings_lost || (!angles.gap.empty() && !angles.gap_was_planned) ||
                        (!lengths.gap.empty() && !lengths.gap_was_planned);
    }
    std::string bent;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!id.is_rotation() && map.is_bent(id) && map.lengths(id.axis).determined[static_cast<int>(id.component)])
            bent += (bent.empty() ? "" : ", ") + id.name();
    }
    if (!bent.empty())
        sentences.push_back(bent +
                            ": readings were lost, and the laser angles of the lines that bridge them are not "
                            "determined; measure the lost points again");
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!map.is_determined(id) || map.is_slope_determined(id)) continue;
        const auto planned = std::any_of(plan.scale_lines().begin(), plan.scale_lines().end(),
                                         [&](const Line& line) { return line.moves(id.axis); });
        sentences.push_back("slope of " + id.name() + " (scale of " + letter(id.axis) + "): " +
                            (planned ? "measure both ends of its scale line"
                                     : std::string("add the scale line ") +
                                           std::array<const char*, 3>{"p00", "0p0", "00p"}[index(id.axis)]));
    }
    for (const Squareness s : all_squarenesses)
        if (!map.is_determined(s))
            sentences.push_back(name(s) + (readings_lost || !bent.empty()
                                               ? ": measure the lost points again"
                                               : ": add body diagonals, or the two face diagonals of its plane"));
    return sentences;
}

}  // namespace

Calibration evaluate_enhanced(const Measurement& measurement, const Plan& plan, const Chain& chain,
                              const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                              const EvaluationOptions& options) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    const auto passes = collect_passes(measurement, plan, heads, options.uncertainty, LengthKind::lever_arm_corrected);
    check(options.plausible);
    refuse_foreign_distances(measurement, plan);
    if (const std::string far = far_reading(measurement, plan); !far.empty()) throw InvalidArgument(far);
    const EnhancedMap map(passes, plan, chain, tool);
    Calibration calibration{"enhanced", chain, plan.volume(), tool, {}, {}, explain(map, plan), {}};
    evaluate_linear(map, passes, plan, options.full_covariance, calibration);
    calibration.fit = Fit::unchecked;
    if (!is_anything_determined(calibration))
        throw InvalidArgument("enhanced evaluation: nothing can be determined. " + calibration.undetermined.front());
    refuse_implausible(calibration, measurement, plan, options.plausible);
    return calibration;
}

}  // namespace stepdiag
