// Gauss-Newton on the adjustment's normal equations, and what they leave open, from a place that is near or without any
// knowledge of where the solution is. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "adjustment/normal_equations.hpp"

namespace stepdiag {

// Rank is decided on the normal equations at zero, columns scaled to 1: a pivot at or below this counts as 0. It is the
// square of a singular value: directions known 3e5 times worse than the best ones still count as determined.
inline constexpr double rank_threshold = 1e-11;

class GaussNewton {
public:
    // `smoothness`: deviations of second differences by function, 0 for none.
    GaussNewton(const AdjustmentProblem& problem, const std::array<double, function_count>& smoothness);

    NormalEquations& equations() { return equations_; }
    const NormalEquations& equations() const { return equations_; }
    // One unknown for each dimension that the readings leave open, decided at zero: those which depend on the others.
    const std::vector<int>& dependent() const { return dependent_; }
    // From here on unknowns that are not determined are what is usual, so that there is one solution.
    void assume_usual(const std::vector<bool>& determined);
    const BorderedFactor& factor() const { return *factor_; }
    const Eigen::VectorXd& scale() const { return scale_; }  // length of each column of the weighted problem

    // For changes of held unknowns, 0 for all others: the changes of all unknowns with them that no reading sees (at
    // the last factorisation).
    BorderedFactor::Sides null_vectors(BorderedFactor::Sides changes) const;
    // The same for sums of unknowns, by their coefficients: in the row of a held unknown, how much a sum changes with
    // the null vector in which that unknown changes by 1.
    BorderedFactor::Sides along_null_vectors(BorderedFactor::Sides coefficients) const;

    static constexpr int usual_most_steps = 100;
    // From x to the minimum: the number of steps, or none where it is not reached in `most_steps`, x being the last.
    std::optional<int> try_solve(Eigen::VectorXd& x, int most_steps = usual_most_steps);
    // Throws InvalidArgument where it is not reached.
    int solve(Eigen::VectorXd& x);
    // Plain steps from zero, none of them made to fit: the least square sum that was met, infinite where no number was.
    double least_on_the_way(int most_steps);
    // Derivatives and factor at x, for what has changed (readings left out, smoothness) or for uncertainties.
    void factorize(const Eigen::VectorXd& x);
    // Derivatives at x, and the factor where it is of somewhere else.
    void refresh(const Eigen::VectorXd& x);

private:
    // One Gauss-Newton step with the derivatives and the factor that there are.
    struct Step {
        Eigen::VectorXd dx;
        double effect;     // largest of one unknown's on the readings, in standard uncertainties
        double change;     // largest, rad and metres
        double decrement;  // of the square sum, were the problem linear
    };
    Step step(const Eigen::VectorXd& x) const;
    // What is minimised: the square sum, and what is assumed to be usual.
    double objective(const Eigen::VectorXd& x) const;
    // Moves x by the step, or by one of Newton's where the square sum is not quadratic enough for that. False where
    // none makes it smaller.
    bool descend(Eigen::VectorXd& x, const Step& step);
    void follow_set_ups(Eigen::VectorXd& x);
    bool is_settled(const Step& step, double ratio, const Eigen::VectorXd& x) const;

    void factorize();  // with the derivatives that there are

    NormalEquations equations_;
    BorderedBand matrix_;
    std::optional<BorderedFactor> factor_;
    Eigen::VectorXd scale_;  // square roots of the diagonal at the last factorisation
    std::vector<int> held_, dependent_;
    Eigen::VectorXd factorized_at_;
    Eigen::VectorXd stiffness_;  // 1/usual^2 of what damping holds: the set-ups
    double damping_ = 0.0;
    double rounding_ = 0.0;  // of the square sum: what the rounding of readings and models adds to it
    bool fresh_ = true;      // derivatives and factor are those at zero, from the beginning
};

// From zero to the minimum: the number of steps, or none where no minimum is reached. `determined`: the unknowns that
// the readings determine; the others are assumed to be usual, in the end where they came out. Several paths are tried
// where the first ends at a square sum that no sound run has; the least minimum counts.
std::optional<int> solve_from_zero(GaussNewton& solver, const std::vector<bool>& determined, Eigen::VectorXd& x,
                                   int most_steps = GaussNewton::usual_most_steps);

}  // namespace stepdiag
