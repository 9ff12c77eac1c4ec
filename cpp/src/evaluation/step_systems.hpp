// Small systems of equations of single steps: eq. 4 for the angles, and the corresponding one for the lengths.
// Internal.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "evaluation/least_squares.hpp"
#include "evaluation/passes.hpp"
#include "stepdiag/evaluation/undetermined.hpp"

namespace stepdiag {

// One value of one reading: `channel` 0 is the length, 1 alpha, 2 beta.
struct ReadingTerm {
    int reading;
    int channel;
    double coefficient;
};
using ReadingSum = std::vector<ReadingTerm>;

// One interval of one axis: the steps that were read at both ends, and the pseudoinverse that solves them for three
// components. If readings were lost and these steps do not suffice: sums of readings that bridge the lost points.
struct StepSystem {
    std::vector<Step> steps;
    std::shared_ptr<const LeastSquares>
        solution;  // 3 unknowns; one equation for each step (length) or two (alpha, beta)
    bool is_bridged = false;
    std::array<ReadingSum, 3> bridge;  // the components, if it is bridged
    std::array<bool, 3> determined{};  // which components
};

// All intervals of an axis.
struct AxisSystem {
    std::vector<StepSystem> intervals;
    std::array<bool, 3> determined{};  // components that are determined in every interval
    std::optional<Undetermined> gap;   // otherwise: the first interval that lacks readings
};
using AxisSystems = std::array<AxisSystem, 3>;

// Angles: increments of (alpha, beta) are the first two rows of machine_R_line^T times the increment of theta.
AxisSystems make_angle_systems(const std::vector<Pass>& passes, const std::array<AxisSteps, 3>& steps,
                               const Plan& plan);

// Lengths: increments are the line's direction times the increment of delta. Passes that are not `usable` are left out.
AxisSystems make_length_systems(const std::vector<Pass>& passes, const std::array<AxisSteps, 3>& steps,
                                const Plan& plan, const std::vector<bool>& usable);

// Change of length along a direction over an interval, as a sum of lengths; empty if they do not determine it.
std::optional<ReadingSum> solve_length_along(const StepSystem& interval, const Eigen::RowVector3d& direction,
                                             const std::vector<Pass>& passes);

}  // namespace stepdiag
