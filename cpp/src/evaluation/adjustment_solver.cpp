#include "evaluation/adjustment_solver.hpp"

#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr int most_steps = 50;
// A step that changes angles by less (rad, and lengths by less of a metre) leaves the factor as good as new.
constexpr double factor_holds = 1e-9;
// A step's effect on the readings, in standard uncertainties, below which it may be rounding.
constexpr double small_effect = 1e-3, no_effect = 1e-6;
constexpr double small_change = 1e-9;  // rad, metres

}  // namespace

AdjustmentSolver::AdjustmentSolver(const AdjustmentProblem& problem,
                                   const std::array<double, function_count>& smoothness)
    : equations_(problem), matrix_(equations_.matrix()) {
    equations_.make_smooth(smoothness);
    equations_.linearise(Eigen::VectorXd::Zero(problem.size()));
    equations_.drop_roundings();
    factorize();
    held_ = factor_->held();
    for (const int j : held_)  // the band has places without an unknown
        if (j >= 6 * problem.blocks() || j % 6 < 3 || problem.has_rotations()) dependent_.push_back(j);
}

void AdjustmentSolver::assume_usual(const std::vector<bool>& determined) {
    if (dependent_.empty()) return;
    equations_.assume_usual(determined, Eigen::VectorXd::Zero(matrix_.size()));
    held_.clear();
    factorize();
    held_ = factor_->held();
}

void AdjustmentSolver::factorize(const Eigen::VectorXd& x) {
    equations_.linearise(x);
    factorize();
    factorized_at_ = x;
}

void AdjustmentSolver::factorize() {
    equations_.assemble(matrix_);
    scale_ = matrix_.diagonal().cwiseSqrt();
    for (const int j : held_) element(matrix_, j, j) = 0.0;  // which holds it again
    if (factor_) factor_->factorize(matrix_);
    else factor_.emplace(matrix_, rank_threshold);
}

void AdjustmentSolver::refresh(const Eigen::VectorXd& x) {
    if (factorized_at_.size() == 0) factorized_at_.setZero(x.size());  // by the constructor
    double change = 0.0;
    for (int j = 0; j < x.size(); ++j)
        change = std::max(change, std::abs(x[j] - factorized_at_[j]) * equations_.problem().change_scale()[j]);
    if (change > factor_holds) factorize(x);
    else equations_.linearise(x);
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

int AdjustmentSolver::solve_open(const std::vector<bool>& determined, Eigen::VectorXd& x) {
    const int count = solve(x);
    if (dependent_.empty()) return count;
    equations_.assume_usual(determined, x);
    return count + solve(x);
}

int AdjustmentSolver::solve(Eigen::VectorXd& x) {
    constexpr double enough = 1e-9;    // of a standard uncertainty
    constexpr double rounding = 1e-6;  // of a step: of double precision, the condition takes this much
    constexpr double infinite = std::numeric_limits<double>::infinity();
    double change = fresh_ && x.isZero(0.0) ? 0.0 : infinite, effect = infinite;
    fresh_ = false;
    for (int count = 1; count <= most_steps; ++count) {
        if (change > factor_holds) factorize(x);
        else if (count > 1) equations_.linearise(x);
        if (!equations_.residuals().allFinite()) break;
        const double before = effect;
        effect = step(x, change);
        if (effect * std::max(effect / before, rounding) < enough) return count;  // as the next step would be
        // Rounding is what no longer shrinks. With noise the last steps shrink slowly, too, down to no effect at all.
        if (effect >= 0.25 * before && effect < no_effect) return count;
        if (effect >= 0.7 * before && (effect < small_effect || change < small_change)) return count;
    }
    throw InvalidArgument(
        "adjustment: finds no machine and set-up that explain the readings; check plan, chain, head and units");
}

void AdjustmentSolver::solve_nearby(Eigen::VectorXd& x) {
    constexpr int most_nearby = 6;
    constexpr double enough = 1e-3;  // of a standard uncertainty
    const Eigen::VectorXd start = x;
    double change = 0.0, effect = std::numeric_limits<double>::infinity();
    for (int count = 0; count < most_nearby; ++count) {
        equations_.linearise(x, false);
        const double before = effect;
        effect = step(x, change);
        if (effect * (effect / before) < enough) return;  // by the step that would be next
    }
    x = start;
    solve(x);
    factorize(start);
}

}  // namespace stepdiag
