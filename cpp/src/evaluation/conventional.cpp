#include "stepdiag/evaluation/conventional.hpp"

#include <algorithm>

#include "evaluation/conventional_map.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

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
    Calibration calibration{"conventional", chain, plan.volume(), tool, {}, {}, {}, {}};
    evaluate_linear(map, passes, plan, options.full_covariance, calibration);
    calibration.fit = Fit::unchecked;
    for (const Axis axis : all_axes)
        if (const AxisSystem& system = map.lengths(axis); !system.gap.empty())
            calibration.undetermined.push_back(
                std::string("translations of ") + letter(axis) + ": " + system.gap +
                (system.gap_was_planned ? "; three body diagonals of different direction are needed at every step"
                                        : "; measure the lost points again"));
    if (!is_anything_determined(calibration))
        throw InvalidArgument("conventional evaluation: nothing can be determined. " +
                              calibration.undetermined.front());
    refuse_implausible(calibration, measurement, plan, options.plausible);
    calibration.undetermined.push_back("rotations: the conventional evaluation uses distances only");
    return calibration;
}

}  // namespace stepdiag
