// The adjustment of a first run, ready for other readings of the same pattern: what is determined, the solution, and
// derivatives and factor there. Internal: not installed.
#pragma once

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {

// Stays where it is: the solver refers to the problem.
struct PreparedAdjustment {
    AdjustmentProblem problem;
    // Deviations of second differences, 0: none. Those that were cross-validated are not in force at the start, where
    // it is decided what is determined.
    std::array<double, function_count> smoothness_at_start, smoothness;
    GaussNewton solver;
    std::vector<LinearForm> forms;  // the values of the calibration's tables
    std::vector<bool> determined;
    Eigen::VectorXd start;  // the solution; unknowns that are not determined are taken to be there

    // Nothing is left out as an outlier. `smoothness`: as adjust found it, or as the options give it.
    PreparedAdjustment(const Measurement& measurement, const Plan& plan, const Chain& chain,
                       const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options,
                       const std::array<double, function_count>& smoothness);
    // With a solver of its own.
    PreparedAdjustment(const PreparedAdjustment& other);
    PreparedAdjustment& operator=(const PreparedAdjustment&) = delete;
};

}  // namespace stepdiag
