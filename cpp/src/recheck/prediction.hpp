// Readings predicted from a calibration: linear in what is uncertain of it, z, and in the set-ups of the lines, s.
// Internal: not installed.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "adjustment/adjustment_problem.hpp"
#include "evaluation/fit_test.hpp"
#include "recheck/baseline.hpp"
#include "stepdiag/recheck/verification.hpp"

namespace stepdiag {

// sum += a^T a, the lower triangle.
void add_square(const Eigen::MatrixXd& a, Eigen::MatrixXd& sum);

// Of components of z. Below, what a prior allows changes the square sum by less, be it there or not.
inline constexpr double least_information = 1e-2;

// Of all points with readings.
Baseline::Positions read_positions(const AdjustmentProblem& problem);

// All is in units of standard uncertainties: readings of their own, z of its prior. The normal equations are a dense
// block of z, bordered by a small block of each set-up, which couple with it alone.
class Prediction {
public:
    // `sent`: see verify().
    Prediction(const AdjustmentProblem& problem, const Baseline& baseline, MotorShifts sent = {});

    // Of the readings of a set-up, a row each, at the calibration's values and the set-up that fits best there.
    struct Derivatives {
        Eigen::MatrixXd by_setup, by_baseline;
        Eigen::VectorXd weight;     // 1/u^2 of the priors of the set-up's unknowns
        std::vector<bool> is_free;  // those without a prior, whose weight hardly counts
    };
    std::vector<Derivatives> derivatives();  // by set-up

    // To the minimum of e^T e + z^T z + priors of s. Where that is not reached, as near as it gets: the square sum is
    // then larger than the minimum.
    void solve();
    // After solve(): the estimate without the changes of the baseline, linear from there. What a changed machine reads
    // would take set-ups that must explain it far away from where anything is linear.
    void drop_changes();
    double chi_square() const;
    // After solve(). Of the test whether all readings go with what is known: nothing is known of `count` components of
    // z from `begin` on, as far as the readings tell them. Their priors say how far they may be from 0, so that with
    // them the square sum would be too small by one for each that is 0.
    ChiSquare fit(Eigen::Index begin, Eigen::Index count) const;

    // A sum of readings, in native units.
    struct Term {
        int reading;
        double weight;
    };
    struct Deviation {
        double value;                 // read - predicted at z = 0 and the set-ups as they were found
        double standard_uncertainty;  // of the value
    };
    // Of readings of one set-up. After solve().
    Deviation deviation(const std::vector<Term>& sum) const;
    // What is left of a reading at the estimate, and its standard uncertainty. After solve().
    Deviation misfit(int reading) const;
    // Of readings that are not used: read - predicted at the estimate, mm or rad; by reading, 0 of all others. After
    // solve().
    const std::vector<double>& missed() const { return missed_; }

    // After solve(): z, and the inverse of its covariance. The root's columns come first, those of the changes last of
    // them.
    const Eigen::VectorXd& values() const { return z_; }
    const Eigen::MatrixXd& information() const { return matrix_; }
    // Columns of its inverse.
    Eigen::MatrixXd covariance_columns(Eigen::Index begin, Eigen::Index count) const;
    // What the readings tell of some components by their priors, everything else being estimated with them.
    Eigen::MatrixXd information(Eigen::Index begin, Eigen::Index count) const;

private:
    struct SetupRows {
        std::vector<int> points;    // of the problem
        std::vector<int> readings;  // likewise, in the order of the points
        Eigen::VectorXd weight;     // 1/u^2 of the priors of s
        Eigen::VectorXd stiffness;  // 1/u^2 of what is usual of s
        Eigen::MatrixXd by_setup, by_baseline;
        Eigen::VectorXd residual;
        Eigen::VectorXd value;                       // s
        Eigen::VectorXd gradient;                    // by s
        Eigen::MatrixXd curvature, curved_coupling;  // by s, and by s and z
        // At the last factorisation: A = S^T S + P, T = A^-1 S^T Z, and L^-1 T^T with the factor L of z.
        Eigen::LDLT<Eigen::MatrixXd> factor;
        Eigen::MatrixXd transfer, spread;
    };

    void weigh_readings();
    void collect_rows();
    void linearise(SetupRows& rows, const Eigen::VectorXd& z, bool derivatives);
    void settle_setups();
    void linearise(bool derivatives);  // all, at z and s
    void find_curvature();
    // The normal equations of the last derivatives, and their factors; false where there are none.
    bool factorize(bool curved = false, double damping = 0.0);
    double decrement() const;  // by which the square sum would fall if it were a quadratic
    bool moves(double least_decrease);
    double step();  // the decrement before it; 0 where the square sum falls no more
    static double objective(const SetupRows& rows);

    const AdjustmentProblem& problem_;
    const Baseline& baseline_;
    MotorShifts sent_;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root_;  // of the baseline
    std::vector<double> sigma_;                                                    // by reading
    int used_ = 0;                                                                 // readings; the others stay out
    std::vector<int> place_;                                                       // by reading: row in its set-up
    std::vector<int> setup_of_;                                                    // by reading
    std::vector<double> missed_;
    std::vector<SetupRows> setups_;
    Eigen::VectorXd z_;
    double damping_ = 0.0;
    bool is_factor_here_ = false;  // and the derivatives
    Eigen::MatrixXd matrix_;
    Eigen::VectorXd gradient_;                      // half of the square sum's derivative by z, downwards
    Eigen::LLT<Eigen::MatrixXd> factor_;            // of matrix_
    std::vector<Eigen::VectorXd> stated_residual_;  // by set-up: at z = 0, s^
};

}  // namespace stepdiag
