#include "adjustment/gauss_newton.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "adjustment/rank_decision.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// A step that changes angles by less (rad, and lengths by less of a metre) leaves the factor as good as new.
constexpr double factor_holds = 3e-11;
}  // namespace

GaussNewton::GaussNewton(const AdjustmentProblem& problem, const std::array<double, function_count>& smoothness)
    : equations_(problem), matrix_(equations_.matrix()) {
    equations_.make_smooth(smoothness);
    equations_.linearise(Eigen::VectorXd::Zero(problem.size()));
    equations_.drop_roundings();
    factorize();
    factorized_at_.setZero(problem.size());
    held_ = factor_->held();
    dependent_ = dependent_unknowns(problem, *factor_);
}

void GaussNewton::assume_usual(const std::vector<bool>& determined) {
    if (dependent_.empty()) return;
    equations_.assume_usual(determined, Eigen::VectorXd::Zero(matrix_.size()));
    held_.clear();
    factorize();
    held_ = factor_->held();
}

void GaussNewton::factorize(const Eigen::VectorXd& x) {
    equations_.linearise(x);
    factorize();
    factorized_at_ = x;
    fresh_ = false;
}

void GaussNewton::factorize() {
    equations_.assemble(matrix_);
    scale_ = matrix_.diagonal().cwiseSqrt();
    for (const int j : held_) element(matrix_, j, j) = 0.0;  // which holds it again
    if (factor_) factor_->factorize(matrix_);
    else factor_.emplace(matrix_, rank_threshold);
}

void GaussNewton::refresh(const Eigen::VectorXd& x) {
    double change = 0.0;
    for (int j = 0; j < x.size(); ++j)
        change = std::max(change, std::abs(x[j] - factorized_at_[j]) * equations_.problem().change_scale()[j]);
    if (change > factor_holds) factorize(x);
    else equations_.linearise(x);
}

Eigen::VectorXd GaussNewton::null_vector(int held) const {
    Eigen::VectorXd vector = Eigen::VectorXd::Unit(scale_.size(), held);
    // The second round takes off what the first left by rounding.
    for (int round = 0; round < 2; ++round) {
        Eigen::VectorXd image = equations_.product(vector);
        factor_->solve(image);
        vector -= image;
    }
    return vector;
}

GaussNewton::Step GaussNewton::step(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd gradient = equations_.gradient(x);
    Step step{gradient, 0.0, 0.0, 0.0};
    factor_->solve(step.dx);
    step.decrement = gradient.dot(step.dx);
    step.effect = step.dx.cwiseProduct(scale_).cwiseAbs().maxCoeff();
    for (int j = 0; j < x.size(); ++j)
        step.change = std::max(step.change, std::abs(step.dx[j]) * equations_.problem().change_scale()[j]);
    return step;
}

bool GaussNewton::is_settled(const Step& step, double ratio, const Eigen::VectorXd& x) const {
    constexpr double enough = 1e-9;     // of a standard uncertainty
    constexpr double rounding = 1e-6;   // of a step: of double precision, the condition takes this much
    constexpr double no_effect = 1e-6;  // where a step may be rounding
    constexpr double settled = 1e-12;   // square of what is left, in uncertainties of whatever is known worst
    if (step.effect * std::max(ratio, rounding) < enough) return true;  // as the next step would be
    if (ratio >= 0.25 && step.effect < no_effect) return true;          // rounding is what no longer shrinks
    const double scatter = equations_.square_sum(x) / double(equations_.problem().readings().size());
    return ratio > 1e-3 && step.decrement < settled * std::max(1.0, scatter);
}

std::optional<int> GaussNewton::try_solve(Eigen::VectorXd& x, int most_steps, bool accelerated) {
    constexpr double slow = 0.1;
    constexpr double infinite = std::numeric_limits<double>::infinity();
    double change = fresh_ && x.isZero(0.0) ? 0.0 : infinite, effect = infinite;
    fresh_ = false;
    StepHistory history;
    for (int count = 1; count <= most_steps; ++count) {
        if (change > factor_holds) factorize(x);
        else if (count > 1) equations_.linearise(x);
        if (!equations_.residuals().allFinite()) break;
        const Step step = this->step(x);
        const double ratio = step.effect / effect;
        const bool is_slow = accelerated && ratio >= slow;
        if (is_settled(step, ratio, x)) {
            x += step.dx;
            return count;
        }
        // Where residuals are large, steps shrink slowly, along a few directions: the sequence then tells its limit.
        if (!is_slow) history.clear();
        history.add(x, step.dx, scale_);
        if (ratio < slow) x += step.dx;
        else descend(x, is_slow ? history.accelerated() : step.dx, step.dx);
        effect = step.effect;
        change = is_slow ? infinite : step.change;
    }
    return std::nullopt;
}

void GaussNewton::descend(Eigen::VectorXd& x, const Eigen::VectorXd& move, const Eigen::VectorXd& step) {
    constexpr int most_halvings = 12;
    const double before = equations_.square_sum(x);
    Eigen::VectorXd part = move;
    for (int i = 0; i <= most_halvings; ++i) {
        if (i > 0) part = std::ldexp(1.0, -i) * step;
        equations_.linearise(x + part, false);
        if (equations_.square_sum(x + part) <= before * 1.0001 + 1.0) break;  // or nearly so: rounding, a flat valley
    }
    x += part;
}

int GaussNewton::solve(Eigen::VectorXd& x) {
    if (const auto count = try_solve(x)) return *count;
    throw InvalidArgument("adjustment: finds no machine and set-up that explain the readings");
}

// Anderson acceleration (D. G. Anderson, J. ACM 12 (1965) 547) of the sequence x + dx(x): the combination of the last
// steps that is least says where they lead.
void GaussNewton::StepHistory::add(const Eigen::VectorXd& x, const Eigen::VectorXd& dx, const Eigen::VectorXd& scale) {
    constexpr std::size_t most = 6;
    if (last_x.size() > 0) {
        moves.push_back(x - last_x);
        changes.push_back(dx - last_dx);
        if (moves.size() > most) {
            moves.erase(moves.begin());
            changes.erase(changes.begin());
        }
    }
    last_x = x;
    last_dx = dx;
    weight = scale;
}

Eigen::VectorXd GaussNewton::StepHistory::accelerated() const {
    const Eigen::Index count = Eigen::Index(changes.size());
    Eigen::VectorXd result = last_dx;
    if (count == 0) return result;
    Eigen::MatrixXd square(count, count);
    Eigen::VectorXd right(count);
    for (Eigen::Index i = 0; i < count; ++i) {
        const Eigen::VectorXd weighted = changes[i].cwiseProduct(weight).cwiseProduct(weight);
        right[i] = weighted.dot(last_dx);
        for (Eigen::Index j = 0; j < count; ++j) square(i, j) = weighted.dot(changes[j]);
    }
    square.diagonal() *= 1.0 + 1e-10;  // of steps that are all alike
    const Eigen::VectorXd share = square.ldlt().solve(right);
    if (!share.allFinite()) return result;
    for (Eigen::Index i = 0; i < count; ++i) result -= share[i] * (moves[i] + changes[i]);
    return result;
}

}  // namespace stepdiag
