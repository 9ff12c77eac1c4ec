#include "evaluation/adjustment_solver.hpp"

#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr int most_steps = 30;
// A step that changes angles by less (rad, and lengths by less of a metre) leaves the derivatives good enough to go on
// with: the next step then is in error by this part of itself.
constexpr double derivatives_hold = 1e-5;
// A step's effect on the readings, in standard uncertainties, below which it may be rounding.
constexpr double small_effect = 1e-3;
constexpr double small_change = 1e-9;  // rad, metres

}  // namespace

AdjustmentSolver::AdjustmentSolver(const AdjustmentProblem& problem,
                                   const std::array<double, function_count>& smoothness)
    : equations_(problem), matrix_(equations_.matrix()) {
    equations_.make_smooth(smoothness);
    factorize(Eigen::VectorXd::Zero(problem.size()));
    held_ = factor_->held();
    for (const int j : held_)  // the band has places without an unknown
        if (j >= 6 * problem.blocks() || j % 6 < 3 || problem.has_rotations()) dependent_.push_back(j);
}

void AdjustmentSolver::assume_usual(const std::vector<bool>& determined) {
    if (dependent_.empty()) return;
    equations_.assume_usual(determined);
    held_.clear();
    factorize(Eigen::VectorXd::Zero(matrix_.size()));
    held_ = factor_->held();
}

void AdjustmentSolver::factorize(const Eigen::VectorXd& x) {
    equations_.linearise(x);
    equations_.assemble(matrix_);
    scale_ = matrix_.diagonal().cwiseSqrt();
    for (const int j : held_) element(matrix_, j, j) = 0.0;  // which holds it again
    if (factor_) factor_->factorize(matrix_);
    else factor_.emplace(matrix_, rank_threshold);
}

Eigen::VectorXd AdjustmentSolver::null_vector(int held) const {
    Eigen::VectorXd vector = Eigen::VectorXd::Unit(scale_.size(), held);
    // The second round takes off what the first left by rounding.
    for (int round = 0; round < 2; ++round) {
        Eigen::VectorXd image = equations_.product(vector);
        factor_->solve(image);
        vector -= image;
    }
    return vector;
}

double AdjustmentSolver::step(Eigen::VectorXd& x, double& change) {
    Eigen::VectorXd dx = equations_.gradient(x);
    factor_->solve(dx);
    x += dx;
    change = 0.0;
    for (int j = 0; j < dx.size(); ++j)
        change = std::max(change, std::abs(dx[j]) * equations_.problem().change_scale()[j]);
    return dx.cwiseProduct(scale_).cwiseAbs().maxCoeff();
}

int AdjustmentSolver::solve(Eigen::VectorXd& x) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    double change = fresh_ && x.isZero(0.0) ? 0.0 : infinite, effect = infinite;
    fresh_ = false;
    for (int count = 1; count <= most_steps; ++count) {
        if (change > derivatives_hold) factorize(x);
        else if (count > 1) equations_.linearise(x, false);
        if (!equations_.residuals().allFinite()) break;
        const double before = effect;
        effect = step(x, change);
        // Rounding is what no longer shrinks.
        if (effect >= 0.25 * before && (effect < small_effect || change < small_change)) return count;
        if (effect == 0.0) return count;
    }
    throw InvalidArgument(
        "adjustment: finds no machine and set-up that explain the readings; check plan, chain, head and units");
}

void AdjustmentSolver::solve_nearby(Eigen::VectorXd& x) {
    constexpr int most_nearby = 6;
    const Eigen::VectorXd start = x;
    double change = 0.0;
    for (int count = 0; count < most_nearby; ++count) {
        equations_.linearise(x, false);
        // The step after one of this size is smaller by what the derivatives are off, and no reading sees it.
        if (step(x, change) < small_effect * small_effect) return;
    }
    x = start;
    solve(x);
    factorize(start);
}

}  // namespace stepdiag
