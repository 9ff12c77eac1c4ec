#include "recheck/same_machine.hpp"

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

std::string text(const Eigen::Vector3d& lengths) { return format_lengths(lengths) + " mm"; }

void check_same_parts(const Calibration& calibration, const Plan& plan, const Chain& chain,
                      const Eigen::Vector3d& tool) {
    const auto differ = [](const std::string& what, const std::string& expected, const std::string& came) {
        throw InvalidArgument(what + ": the calibration has " + expected + ", the readings have " + came);
    };
    if (!(calibration.chain == chain)) differ("chain", calibration.chain.name(), chain.name());
    if (calibration.volume != plan.volume()) differ("volume", text(calibration.volume), text(plan.volume()));
    if (calibration.tool != tool) differ("tool", text(calibration.tool), text(tool));
}

void check_same_temperature(const Calibration& calibration, const std::optional<KnownExpansion>& expansion) {
    const auto& reference = calibration.temperature_reference;
    if (reference && !expansion)
        throw InvalidArgument("calibration: is referred to " + std::to_string(*reference) +
                              " degrees Celsius; readings need the expansion of the scales and their temperatures");
    if (reference && expansion && *reference != expansion->expansion.reference)
        throw InvalidArgument("calibration: is referred to " + std::to_string(*reference) +
                              " degrees Celsius, the readings to " + std::to_string(expansion->expansion.reference));
    if (!reference && expansion)
        throw InvalidArgument("calibration: is as it was found, but the readings are to be referred to " +
                              std::to_string(expansion->expansion.reference) +
                              " degrees Celsius; evaluate its run with the expansion, too, or leave it out here");
}

}  // namespace

AdjustmentProblem problem_of_known_machine(const Calibration& calibration, const Measurement& measurement,
                                           const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                                           const HeadCalibrations& heads, const AdjustmentOptions& options) {
    check_same_parts(calibration, plan, chain, tool);
    check_same_temperature(calibration, options.expansion);
    AdjustmentOptions of_known_machine = options;
    of_known_machine.machine_drift.reset();
    of_known_machine.rotations = true;
    of_known_machine.reversal = false;  // of the unknowns: the calibration has its own
    of_known_machine.smoothness.reset();
    AdjustmentProblem problem(measurement, plan, chain, tool, heads, of_known_machine);
    if (problem.readings().empty()) throw InvalidArgument("readings: all are lost");
    return problem;
}

}  // namespace stepdiag
