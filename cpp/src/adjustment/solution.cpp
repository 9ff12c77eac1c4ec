#include "adjustment/solution.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/smoothness.hpp"
#include "stepdiag/adjustment/fit_quality.hpp"

namespace stepdiag {
Solution::Solution(AdjustmentProblem problem, const std::array<double, function_count>& smoothness)
    : problem_(std::move(problem)),
      solver_(problem_, smoothness),
      tables_(problem_),
      observability_(solver_, tables_),
      x_(Eigen::VectorXd::Zero(problem_.size())) {
    solver_.assume_usual(observability_.determined());
}

bool Solution::solve_from_zero(int most_steps) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(problem_.size());
    const std::optional<int> count = stepdiag::solve_from_zero(solver_, observability_.determined(), x, most_steps);
    if (!count) return false;
    iterations_ = *count;
    x_ = x;
    look();
    return true;
}

bool Solution::go_from_zero(int most_steps) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(problem_.size());
    is_minimum_ = solver_.try_solve(x, most_steps).has_value();
    if (!x.allFinite()) return false;
    iterations_ = most_steps;
    x_ = x;
    look();
    return std::isfinite(square_sum_);
}

bool Solution::solve_from(const Eigen::VectorXd& start) {
    if (!solver_.dependent().empty()) solver_.equations().assume_usual(observability_.determined(), start);
    Eigen::VectorXd x = start;
    constexpr int most_steps = 20;  // what is near takes five
    const std::optional<int> count = solver_.try_solve(x, most_steps);
    if (!count) return false;
    iterations_ = *count;
    x_ = x;
    look();
    return true;
}

void Solution::solve_again() {
    solver_.solve(x_);
    look();
}

void Solution::linearise(const Eigen::VectorXd& x) {
    if (is_looked_at_ && solver_.dependent().empty() && x == x_) return;
    if (!solver_.dependent().empty()) solver_.equations().assume_usual(observability_.determined(), x);
    if (!x.isZero(0.0)) solver_.factorize(x);
    inverse_.reset();
    reading_variances_.reset();
    is_looked_at_ = false;
}

void Solution::look() {
    solver_.refresh(x_);
    square_sum_ = solver_.equations().square_sum(x_);
    inverse_.reset();
    reading_variances_.reset();
    is_looked_at_ = true;
}

const BorderedBand& Solution::inverse() {
    if (!inverse_) solver_.factor().selected_inverse(inverse_.emplace(solver_.equations().matrix()));
    return *inverse_;
}

const Eigen::VectorXd& Solution::reading_variances() {
    if (!reading_variances_) reading_variances_ = solver_.equations().reading_variances(inverse());
    return *reading_variances_;
}

int Solution::degrees_of_freedom() const { return stepdiag::degrees_of_freedom(solver_); }

std::optional<FitQuality> fit_quality(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options, int most_steps) {
    const AdjustmentProblem problem(measurement, plan, chain, tool, heads, options);
    if (problem.readings().empty()) return std::nullopt;
    GaussNewton solver(problem, smoothness_at_start(options));
    solver.assume_usual(std::vector<bool>(std::size_t(problem.size()), false));
    const double square_sum = solver.least_on_the_way(most_steps);
    if (!std::isfinite(square_sum)) return std::nullopt;
    return FitQuality{square_sum, degrees_of_freedom(solver)};
}

}  // namespace stepdiag
