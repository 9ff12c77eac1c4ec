#include "stepdiag/evaluation/enhanced.hpp"

#include <algorithm>

#include "evaluation/enhanced_map.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

std::vector<Undetermined> findings_of(const EnhancedMap& map, const Plan& plan) {
    std::vector<Undetermined> findings;
    for (const Axis axis : all_axes)
        for (const auto& gap : {map.angles(axis).gap, map.lengths(axis).gap})
            if (gap) findings.push_back(*gap);
    Undetermined bent{OpenPart::whole, {}, OpenReason::laser_angles, {Remedy::lost_points}};
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!id.is_rotation() && map.is_bent(id) && map.lengths(id.axis).determined[static_cast<int>(id.component)])
            bent.parameters.push_back(id.name());
    }
    if (!bent.parameters.empty()) findings.push_back(bent);
    const bool readings_lost = std::any_of(findings.begin(), findings.end(), [](const Undetermined& finding) {
        return finding.remedies.front() == Remedy::lost_points;
    });
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!map.is_determined(id) || map.is_slope_determined(id)) continue;
        const auto planned = std::any_of(plan.scale_lines().begin(), plan.scale_lines().end(),
                                         [&](const Line& line) { return line.moves(id.axis); });
        findings.push_back({OpenPart::slope, {id.name()}, OpenReason::not_seen});
        if (planned) {
            findings.back().remedies = {Remedy::scale_line_ends};
        } else {
            findings.back().remedies = {Remedy::scale_line};
            findings.back().line = line_along(id.axis);
        }
    }
    for (const Squareness s : all_squarenesses)
        if (!map.is_determined(s))
            findings.push_back({OpenPart::whole,
                                {name(s)},
                                OpenReason::not_seen,
                                readings_lost ? std::vector{Remedy::lost_points}
                                              : std::vector{Remedy::body_diagonals, Remedy::face_diagonals}});
    return findings;
}

}  // namespace

Calibration evaluate_enhanced(const Measurement& measurement, const Plan& plan, const Chain& chain,
                              const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                              const EvaluationOptions& options) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    const auto passes = collect_passes(measurement, plan, heads, options.uncertainty, LengthKind::lever_arm_corrected,
                                       options.expansion);
    check(options.plausible);
    refuse_foreign_distances(measurement, plan);
    if (const std::string far = far_reading(measurement, plan); !far.empty()) throw InvalidArgument(far);
    const EnhancedMap map(passes, plan, chain, tool);
    Calibration calibration{"enhanced", chain, plan.volume(), tool, {}, {}, findings_of(map, plan)};
    evaluate_linear(map, passes, plan, options.full_covariance, calibration);
    test_fit(map, passes, calibration);
    state_temperature(measurement, options.expansion, calibration);
    if (!is_anything_determined(calibration)) throw NothingDetermined("enhanced evaluation", calibration.findings);
    refuse_implausible(calibration, measurement, plan, options.plausible);
    return calibration;
}

}  // namespace stepdiag
