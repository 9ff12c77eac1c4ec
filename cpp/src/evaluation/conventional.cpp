#include "stepdiag/evaluation/conventional.hpp"

#include <algorithm>

#include "evaluation/conventional_map.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

Calibration evaluate_conventional(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                  const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                  const EvaluationOptions& options) {
    if (!tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    const auto passes =
        collect_passes(measurement, plan, heads, options.uncertainty, LengthKind::distance, options.expansion);
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
    test_fit(map, passes, calibration);
    state_temperature(measurement, options.expansion, calibration);
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
