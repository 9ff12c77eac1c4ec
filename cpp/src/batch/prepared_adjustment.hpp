// The adjustment of a first run, prepared for other readings of the same pattern: what is determined, the solution, and
// the derivatives and the factor at the solution. Internal: not installed.
#pragma once

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {

// Neither copied over nor moved: the solver refers to the problem.
struct PreparedAdjustment {
    AdjustmentProblem problem;
    // Standard deviations of second differences; 0: not smoothed. Cross-validated ones are not used at the start, where
    // the ranks are decided.
    std::array<double, function_count> smoothness_at_start, smoothness;
    GaussNewton solver;
    std::vector<LinearForm> forms;  // the values of the calibration's tables
    std::vector<bool> determined;
    Eigen::VectorXd start;  // the solution; unknowns that are not determined keep these values

    // Leaves out no outliers. `smoothness`: as adjust found it, or as the options give it.
    PreparedAdjustment(const Measurement& measurement, const Plan& plan, const Chain& chain,
                       const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options,
                       const std::array<double, function_count>& smoothness);
    // The copy has its own solver.
    PreparedAdjustment(const PreparedAdjustment& other);
    PreparedAdjustment& operator=(const PreparedAdjustment&) = delete;
};

}  // namespace stepdiag
