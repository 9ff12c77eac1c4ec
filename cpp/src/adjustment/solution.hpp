// An adjustment's problem, its solver, what the readings determine, and the minimum. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "adjustment/adjustment_tables.hpp"
#include "adjustment/gauss_newton.hpp"
#include "adjustment/observability.hpp"

namespace stepdiag {

class Solution {
public:
    // Not solved yet: x is 0. `smoothness`: as of GaussNewton.
    Solution(AdjustmentProblem problem, const std::array<double, function_count>& smoothness);
    Solution(const Solution&) = delete;
    Solution& operator=(const Solution&) = delete;

    const AdjustmentProblem& problem() const { return problem_; }
    GaussNewton& solver() { return solver_; }
    const GaussNewton& solver() const { return solver_; }
    const AdjustmentTables& tables() const { return tables_; }
    const Observability& observability() const { return observability_; }
    const Eigen::VectorXd& x() const { return x_; }
    int iterations() const { return iterations_; }

    // Each says whether the minimum was reached; if not, x stays.
    bool solve_from_zero(int most_steps = GaussNewton::usual_most_steps);
    bool solve_from(const Eigen::VectorXd& start);  // which is near
    // To where so many steps from zero lead, where that is no minimum; false where it is no number.
    bool go_from_zero(int most_steps);
    bool is_minimum() const { return is_minimum_; }
    void solve_again();  // for another smoothness; throws InvalidArgument where it is not reached
    // Equations, factor and inverse at any x, with what is open known to be there.
    void linearise(const Eigen::VectorXd& x);
    void look();  // the same at the minimum
    // After one of these two: of the equations, and what the model says of each reading (NormalEquations).
    const BorderedBand& inverse();
    const Eigen::VectorXd& reading_variances();

    double square_sum() const { return square_sum_; }
    double scatter() const { return square_sum_ / double(problem_.readings().size()); }
    int degrees_of_freedom() const;

private:
    AdjustmentProblem problem_;
    GaussNewton solver_;
    AdjustmentTables tables_;
    Observability observability_;
    Eigen::VectorXd x_;
    std::optional<BorderedBand> inverse_;
    std::optional<Eigen::VectorXd> reading_variances_;
    bool is_looked_at_ = false;  // the minimum, with what is open known to be where it usually is
    int iterations_ = 0;
    bool is_minimum_ = true;
    double square_sum_ = 0.0;
};

}  // namespace stepdiag
