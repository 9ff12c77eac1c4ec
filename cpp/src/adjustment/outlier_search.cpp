#include "adjustment/outlier_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/SpecialFunctions>

#include "adjustment/smoothness.hpp"
#include "adjustment/solve_from_zero.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

double size(const ReadingResidual& residual) { return residual.used() ? std::abs(residual.normalised) : 0.0; }

}  // namespace

int degrees_of_freedom(const GaussNewton& solver) {
    const AdjustmentProblem& problem = solver.equations().problem();
    int count = int(solver.equations().smooth_rows().size()) - problem.unknowns() + int(solver.dependent().size());
    for (const AdjustedReading& reading : problem.readings()) count += reading.used();
    count += problem.informative_priors();
    return count;
}

OutlierSearch::OutlierSearch(AdjustmentProblem& problem, GaussNewton& solver, const AdjustmentOptions& options)
    : problem_(problem), solver_(solver), inverse_(solver.equations().matrix()) {
    const double count = double(problem.readings().size());
    limit_ = options.outlier_probability > 0.0 ? -Eigen::numext::ndtri(options.outlier_probability / (2.0 * count))
                                               : std::numeric_limits<double>::infinity();
    most_ = std::max(10, int(problem.readings().size() / 50));
    roughness_ =
        second_differences(problem, given_deviations({options.uncertainty.distance, options.uncertainty.tilt, false}));
}

int OutlierSearch::solve_without_gross(const std::vector<bool>& determined, Eigen::VectorXd& x) {
    constexpr double gross_scatter = 25.0;  // of the square sum a reading
    constexpr double gross_likeness = 0.9;  // the first step is not exact
    // More are no slips of single readings, but a head that lost count, or a wrong plan.
    constexpr int most_gross = 5;
    for (bool search = true;;) {
        const std::optional<int> count = solve_from_zero(solver_, determined, x);
        const double scatter = solver_.equations().square_sum(x) / double(problem_.readings().size());
        if (count && (scatter < gross_scatter || !search)) return *count;
        Eigen::VectorXd first = Eigen::VectorXd::Zero(x.size());
        if (search) solver_.try_solve(first, 1);
        if (search && found_ < most_gross && leave_out(worst_readings(first, gross_likeness), first)) continue;
        if (!search)
            throw InvalidArgument(
                "adjustment: finds no machine and set-up that explain the readings; check the plan, the head, and "
                "units and signs of the readings");
        // It is not a few readings that do not fit: all stay, and chi-square tells.
        search = false;
        put_back(0);
    }
}

void OutlierSearch::run(const std::vector<bool>& determined, Eigen::VectorXd& x) {
    constexpr double likeness = 0.99;
    const int gross = found_;
    const Eigen::VectorXd before = x;
    for (;;) {
        const std::vector<std::size_t> worst = worst_readings(x, likeness);
        if (worst.empty()) return;
        const Eigen::VectorXd last = x;
        if (!leave_out(worst, x)) {
            put_back(gross);
            x = before;
            return;
        }
        if (!solver_.try_solve(x) && !solve_from_zero(solver_, determined, x)) {
            put_back(found_ - 1);
            x = last;
            return;
        }
    }
}

void OutlierSearch::look(const Eigen::VectorXd& x) {
    if (looked_at_ && *looked_at_ == x) return;
    solver_.refresh(x);
    solver_.factor().selected_inverse(inverse_);
    looked_at_ = x;
    residuals_ = reading_residuals(solver_.equations(), inverse_);
}

void OutlierSearch::put_back(int kept) {  // all outliers after the first `kept`
    for (AdjustedReading& reading : problem_.readings()) {
        if (reading.outlier > kept) reading.outlier = 0;
        if (reading.suspect > kept) reading.suspect = 0;
    }
    found_ = kept;
    looked_at_.reset();
}

bool OutlierSearch::leave_out(const std::vector<std::size_t>& worst, const Eigen::VectorXd& x) {
    if (worst.empty() || found_ == most_) return false;
    ++found_;
    looked_at_.reset();
    for (const std::size_t r : worst) problem_.readings()[r].suspect = found_;
    AdjustedReading& reading = problem_.readings()[roughest(worst, x)];
    reading.suspect = 0;
    reading.outlier = found_;
    return true;
}

// Of readings that no other tells apart, the one without which the error functions are smoothest.
std::size_t OutlierSearch::roughest(const std::vector<std::size_t>& candidates, const Eigen::VectorXd& x) {
    if (candidates.size() == 1) return candidates.front();
    double least = std::numeric_limits<double>::infinity();
    std::size_t chosen = candidates.front();
    for (const std::size_t r : candidates) {
        problem_.readings()[r].outlier = 1;
        solver_.factorize(x);
        Eigen::VectorXd without = solver_.equations().gradient(x);
        problem_.readings()[r].outlier = 0;
        solver_.factor().solve(without);
        without += x;
        double roughness = 0.0;
        for (const SmoothRow& row : roughness_) roughness += std::pow(row.value(without), 2);
        if (roughness >= least) continue;
        least = roughness;
        chosen = r;
    }
    return chosen;
}

// The reading that fits worst, if it is an outlier, and those that no other reading tells from it.
std::vector<std::size_t> OutlierSearch::worst_readings(const Eigen::VectorXd& x, double alike) {
    look(x);
    const auto& residuals = residuals_;
    const double square_sum = solver_.equations().square_sum(x);
    const int freedom = degrees_of_freedom(solver_);
    double worst = 0.0;
    for (const ReadingResidual& residual : residuals) worst = std::max(worst, size(residual));
    // Where all readings scatter more than was said, the worst is measured against that.
    const double others = freedom > 1 ? std::max(1.0, (square_sum - worst * worst) / (freedom - 1)) : 1.0;
    std::vector<std::size_t> found;
    if (worst > limit_ * std::sqrt(others))
        for (std::size_t r = 0; r < residuals.size(); ++r)
            if (size(residuals[r]) >= alike * worst) found.push_back(r);
    return found;
}

}  // namespace stepdiag
