// Which changes of a machine short runs would show, before anyone measures: for comparing many plans with the same
// steps.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "stepdiag/adjustment/line_information.hpp"
#include "stepdiag/recheck/recheck.hpp"

namespace stepdiag {

// What recheck() of such a run would know of the terms of a change.
struct SeenChanges {
    Eigen::VectorXd smallest;    // by term, as smallest_changes_seen
    Eigen::MatrixXd covariance;  // of the terms, with their priors
};

// The derivatives of each line's readings by the calibration and the change, and what they have in common by the
// calibration's covariance. A choice of lines then takes a factor with a row for each of their readings: where that is
// less than what is uncertain of the calibration, a small part of the time of recheck(), whose figures it gives.
class ChangesSeen {
public:
    // `run`: readings without noise of a machine as the baseline has it, at temperatures that stay, each line measured
    // once. Throws InvalidArgument as recheck().
    ChangesSeen(const Calibration& baseline, const Measurement& run, const Plan& plan, const Chain& chain,
                const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options = {},
                const ChangePriors& priors = {});

    // Their values are not estimated here.
    const std::vector<ChangeTerm>& terms() const;
    const Eigen::MatrixXd& shape() const;  // as of Recheck
    // Of lines of the run, measured `repeats` times. Throws InvalidArgument for lines that it does not have, for
    // alpha and power as smallest_changes_seen, and where so few readings would tell nothing of the machine.
    SeenChanges by(const std::vector<ChosenLine>& lines, int repeats, double alpha = 0.001, double power = 0.95);

private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace stepdiag
