#include "adjustment/gauss_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Where angles have changed by less (rad, and lengths by less of a metre) since the factor was made, it serves: for
// steps, which with it still shrink by a factor of 1e4 or so, and for uncertainties, to 1e-6 of them.
constexpr double steps_hold = 1e-7, uncertainties_hold = 3e-10;

// One unknown for each dimension that the readings leave open: those that the factor of the normal equations at zero
// has held because they depend on the others. (The band has places without an unknown, which are held too.)
std::vector<int> dependent_unknowns(const AdjustmentProblem& problem, const BorderedFactor& factor) {
    std::vector<int> dependent;
    for (const int j : factor.held())
        if (j >= 6 * problem.blocks() || j % 6 < 3 || problem.has_rotations()) dependent.push_back(j);
    return dependent;
}

}  // namespace

GaussNewton::GaussNewton(const AdjustmentProblem& problem, const std::array<double, function_count>& smoothness)
    : equations_(problem), matrix_(equations_.matrix()) {
    equations_.make_smooth(smoothness);
    stiffness_.setZero(problem.size());
    for (const LineSetup& setup : problem.setups())
        for (const int c : setup.active) {
            const SetupQuantityRecord& of = record(setup::component(c).quantity);
            stiffness_[setup.unknown[c]] = std::pow(std::min(setup.prior[c], of.usual), -2);
        }
    for (const CoefficientUnknown& of : problem.coefficients()) stiffness_[of.unknown] = std::pow(of.prior, -2);
    for (const AdjustedReading& reading : problem.readings())
        rounding_ += std::pow(reading.of_doubles / reading.standard_uncertainty, 2);
    equations_.linearise(Eigen::VectorXd::Zero(problem.size()));
    equations_.drop_roundings();
    factorize();
    factorized_at_.setZero(problem.size());
    held_ = factor_->held();
    dependent_ = dependent_unknowns(problem, *factor_);
}

double GaussNewton::objective(const Eigen::VectorXd& x) const {
    return equations_.square_sum(x) + (x - equations_.centre()).cwiseAbs2().dot(equations_.usual_weight());
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
    if (factor_) factor_->factorize(std::move(matrix_));
    else factor_.emplace(matrix_, rank_threshold);
}

void GaussNewton::refresh(const Eigen::VectorXd& x) {
    double change = 0.0;
    for (int j = 0; j < x.size(); ++j)
        change = std::max(change, std::abs(x[j] - factorized_at_[j]) * equations_.problem().change_scale()[j]);
    if (change > uncertainties_hold) factorize(x);
    else equations_.linearise(x);
}

BorderedFactor::Sides GaussNewton::null_vectors(BorderedFactor::Sides vectors) const {
    // The second round takes off what the first left by rounding.
    for (int round = 0; round < 2; ++round) {
        BorderedFactor::Sides images = equations_.products(vectors);
        factor_->solve(images);
        vectors -= images;
    }
    return vectors;
}

BorderedFactor::Sides GaussNewton::along_null_vectors(BorderedFactor::Sides coefficients) const {
    for (int round = 0; round < 2; ++round) {
        BorderedFactor::Sides solution = coefficients;
        factor_->solve(solution);
        coefficients -= equations_.products(solution);
    }
    return coefficients;
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
    if (ratio >= 0.25 && step.decrement < rounding_) return true;
    const double scatter = equations_.square_sum(x) / double(equations_.problem().readings().size());
    return ratio > 1e-3 && step.decrement < settled * std::max(1.0, scatter);
}

std::optional<int> GaussNewton::try_solve(Eigen::VectorXd& x, int most_steps) {
    constexpr double slow = 0.1;
    constexpr double infinite = std::numeric_limits<double>::infinity();
    double change = fresh_ && x.isZero(0.0) ? 0.0 : infinite, effect = infinite;
    fresh_ = false;
    damping_ = 0.0;
    for (int count = 1; count <= most_steps; ++count) {
        if (change > steps_hold) factorize(x);
        else if (count > 1) equations_.linearise(x);
        if (!equations_.residuals().allFinite()) break;
        const Step step = this->step(x);
        const double ratio = step.effect / effect;
        if (is_settled(step, ratio, x)) {
            x += step.dx;
            return count;
        }
        if (ratio < slow) x += step.dx;
        else if (!descend(x, step)) break;
        effect = step.effect;
        change = ratio < slow ? step.change : infinite;
    }
    return std::nullopt;
}

// Newton's method, with the curvature of the readings. It is indefinite where the square sum bends downwards: a set-up
// then is held by a part of what is usual, more of it until the square sum falls (K. Levenberg, Quart. Appl. Math. 2
// (1944) 164).
bool GaussNewton::descend(Eigen::VectorXd& x, const Step& step) {
    constexpr double good = 0.75;   // share of what a quadratic would fall by
    constexpr double small = 1e-3;  // of the square sum: next to the minimum Newton's steps shrink faster
    constexpr double first = 1e-2, least = 1e-4, climbs = 10.0, falls = 100.0;
    constexpr double most = 1e12;
    constexpr double rounding = 1e-8;  // of the square sum, of readings that are a million times their noise and more
    const double before = objective(x);
    const auto moves_by = [&](const Eigen::VectorXd& move, double least_decrease) {
        Eigen::VectorXd moved = x + move;
        for (const bool follow : {false, true}) {
            if (follow) follow_set_ups(moved);
            equations_.linearise(moved, false);
            if (!(objective(moved) <= before - least_decrease)) continue;
            x = moved;
            return true;
        }
        return false;
    };
    if (step.decrement > small && moves_by(step.dx, good * step.decrement)) {
        damping_ = 0.0;
        return true;
    }
    equations_.linearise(x);
    const Eigen::VectorXd gradient = equations_.gradient(x);
    BorderedBand curved = matrix_;
    equations_.assemble(curved);
    equations_.add_curvature(x, curved);
    for (; damping_ < most; damping_ = std::max(first, climbs * damping_)) {
        matrix_ = curved;
        for (int j = 0; j < matrix_.size(); ++j) element(matrix_, j, j) += damping_ * stiffness_[j];
        for (const int j : held_) element(matrix_, j, j) = 0.0;
        factor_->factorize(std::move(matrix_));
        if (factor_->held() != held_) continue;
        Eigen::VectorXd move = gradient;
        factor_->solve(move);
        if (!moves_by(move, -rounding * before)) continue;
        damping_ = damping_ < least ? 0.0 : damping_ / falls;
        return true;
    }
    return false;
}

// Machine and constants, on which readings depend linearly, as they fit best where set-ups stay: they follow a set-up
// through a valley of the square sum that is narrow and bent (variable projection: G. H. Golub and V. Pereyra, SIAM J.
// Numer. Anal. 10 (1973) 413).
void GaussNewton::follow_set_ups(Eigen::VectorXd& x) {
    constexpr double stays = 1e12;
    equations_.linearise(x);
    if (!equations_.residuals().allFinite()) return;
    equations_.assemble(matrix_);
    for (int j = 0; j < matrix_.size(); ++j) element(matrix_, j, j) += stays * stiffness_[j];
    for (const int j : held_) element(matrix_, j, j) = 0.0;
    factor_->factorize(std::move(matrix_));
    Eigen::VectorXd move = equations_.gradient(x);
    factor_->solve(move);
    x += move;
}

double GaussNewton::least_on_the_way(int most_steps) {
    constexpr double settled = 1e-6;  // of the square sum, which another step would take off
    Eigen::VectorXd x = Eigen::VectorXd::Zero(matrix_.size());
    double least = std::numeric_limits<double>::infinity();
    for (int count = 0; equations_.residuals().allFinite(); ++count) {
        least = std::min(least, equations_.square_sum(x));
        if (count == most_steps) break;
        if (count > 0) factorize();
        const Step step = this->step(x);
        if (count > 0 && step.decrement < settled) break;
        x += step.dx;
        equations_.linearise(x, count + 1 < most_steps);
    }
    fresh_ = false;
    return least;
}

int GaussNewton::solve(Eigen::VectorXd& x) {
    if (const auto count = try_solve(x)) return *count;
    throw InvalidArgument("adjustment: finds no machine and set-up that explain the readings");
}

// What is open is assumed to be at 0 first, and then, because that pulls at what is determined by its square, where
// it came out.
std::optional<int> solve_from_zero(GaussNewton& solver, const std::vector<bool>& determined, Eigen::VectorXd& x,
                                   int most_steps) {
    // The second order of what is open may lead astray: then once more from zero with the open unknowns held, and
    // whichever fits best.
    constexpr double parts[] = {1.0, 1e-4};
    constexpr double good_fit = 4.0;
    const double readings = double(solver.equations().problem().readings().size());
    std::optional<int> count;
    double least = std::numeric_limits<double>::infinity();
    double best = parts[0];
    for (const double part : parts) {
        Eigen::VectorXd solution = Eigen::VectorXd::Zero(x.size());
        solver.equations().assume_usual(determined, solution, part);
        const std::optional<int> steps = solver.try_solve(solution, most_steps);
        const double square_sum = solver.equations().square_sum(solution);
        if (steps && square_sum < least) {
            count = steps;
            x = solution;
            least = square_sum;
            best = part;
        }
        if (solver.dependent().empty() || (count && least < good_fit * readings)) break;
    }
    if (!count || solver.dependent().empty() || best < 1.0) return count;
    Eigen::VectorXd again = x;
    solver.equations().assume_usual(determined, x);
    const std::optional<int> more = solver.try_solve(again, most_steps);
    // Once more may lead astray, too.
    if (!more || solver.equations().square_sum(again) > 1.01 * std::max(least, readings)) {
        solver.equations().assume_usual(determined, Eigen::VectorXd::Zero(x.size()));
        return count;
    }
    x = again;
    return *count + *more;
}

}  // namespace stepdiag
