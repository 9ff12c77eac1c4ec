// The small systems of equations of single steps: eq. 4 for the angles and its counterpart for the lengths. Internal.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "evaluation/visits.hpp"
#include "stepdiag/evaluation/least_squares.hpp"

namespace stepdiag {

// One interval of one axis: the steps that were read at both ends, and the pseudoinverse that makes three components of
// them.
struct StepSystem {
    std::vector<Step> steps;
    std::shared_ptr<const LeastSquares> solution;  // 3 unknowns; one equation a step (length) or two (alpha, beta)
};

// All intervals of an axis.
struct AxisSystem {
    std::vector<StepSystem> intervals;
    std::array<bool, 3> determined{};  // component: in every interval
    std::string gap;                   // where not: the first interval that lacks readings, in words
};
using AxisSystems = std::array<AxisSystem, 3>;

// Angles: increments of (alpha, beta) are the first two rows of machine_R_line^T times the increment of theta.
AxisSystems make_angle_systems(const std::vector<Visit>& visits, const std::array<AxisSteps, 3>& steps,
                               const Plan& plan);

// Lengths: increments are the line's direction times the increment of delta. Visits that are not `usable` are left out.
AxisSystems make_length_systems(const std::vector<Visit>& visits, const std::array<AxisSteps, 3>& steps,
                                const Plan& plan, const std::vector<bool>& usable);

}  // namespace stepdiag
