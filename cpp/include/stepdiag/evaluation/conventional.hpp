// The classic evaluation of a step-diagonal run (C. Wang, Rev. Sci. Instrum. 71 (2000) 3933): distances only.
// Each step of axis a over interval i changes the distance of line d by s_d n_d . (delta_a(i+1) - delta_a(i)), n_d the
// line's direction. Three or four body diagonals give three or four such equations for the three components of the
// step: solved by pseudoinverse and summed from home. Angular errors and misalignment are taken for errors of
// translation.
#pragma once

#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

// Throws InvalidArgument for fewer than three body diagonals, readings that do not belong to the plan, or a result that
// is not plausible. The verdict of the fit is what its contradictions say: four
// diagonals for three translations of each step.
// Rotations are absent from the result. Scale lines and other lines are not used.
Calibration evaluate_conventional(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                  const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                  const EvaluationOptions& options = {});

}  // namespace stepdiag
