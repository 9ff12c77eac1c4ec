#include "evaluation/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "support/refuses.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using stepdiag::solve_least_squares;

MatrixXd random_matrix(int rows, int columns, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    MatrixXd m(rows, columns);
    for (auto& x : m.reshaped()) x = normal(engine);
    return m;
}

}  // namespace

TEST(LeastSquares, StraightLineOfTheGumIsFound) {  // JCGM 100, annex H.3: a thermometer's corrections b over t, t0 = 20
    const VectorXd t{{21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511}};
    const VectorXd b{{-.171, -.169, -.166, -.159, -.164, -.165, -.156, -.157, -.159, -.161, -.160}};
    MatrixXd a(11, 2);
    a << VectorXd::Ones(11), t.array() - 20.0;
    const auto solution = solve_least_squares(a, VectorXd::Constant(11, 0.0035));
    const VectorXd x = solution.pseudoinverse * b;
    const double variance = (a * x - b).squaredNorm() / 9.0;
    const MatrixXd covariance = solution.pseudoinverse * variance * solution.pseudoinverse.transpose();
    // Half a unit of the last digit that the GUM prints.
    EXPECT_NEAR(x[0], -0.1712, 0.5e-4);
    EXPECT_NEAR(x[1], 0.00218, 0.5e-5);
    EXPECT_NEAR(std::sqrt(covariance(0, 0)), 0.0029, 0.5e-4);
    EXPECT_NEAR(std::sqrt(covariance(1, 1)), 0.00067, 0.5e-5);
    EXPECT_NEAR(covariance(0, 1) / std::sqrt(covariance(0, 0) * covariance(1, 1)), -0.930, 0.5e-3);
    const Eigen::Vector2d at30(1.0, 10.0);
    EXPECT_NEAR(at30.dot(x), -0.1494, 0.5e-4);
    EXPECT_NEAR(std::sqrt(at30.dot(covariance * at30)), 0.0041, 0.5e-4);
}

TEST(LeastSquares, PseudoinverseSolvesTheWeightedNormalEquations) {
    const MatrixXd a = random_matrix(12, 4, 1);
    const VectorXd u = random_matrix(12, 1, 2).cwiseAbs().array() + 0.1;
    const MatrixXd w = u.array().square().inverse().matrix().asDiagonal();
    const MatrixXd expected = (a.transpose() * w * a).inverse() * a.transpose() * w;
    const auto solution = solve_least_squares(a, u);
    EXPECT_EQ(solution.rank, 4);
    // The normal equations square a condition of some ten.
    EXPECT_LE((solution.pseudoinverse - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(LeastSquares, UnknownsOfDifferentSizeAreFoundAlike) {  // mm beside rad, metres beside nanometres
    MatrixXd a = random_matrix(8, 3, 3);
    a.col(1) *= 1e-9;
    a.col(2) *= 1e6;
    const auto solution = solve_least_squares(a, VectorXd::Ones(8));
    EXPECT_EQ(solution.rank, 3);
    EXPECT_EQ(solution.determined, (std::vector<bool>{true, true, true}));
    EXPECT_LE((solution.pseudoinverse * a - MatrixXd::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-12 * 1e15);
    EXPECT_NEAR((solution.pseudoinverse * a)(1, 1), 1.0, 1e-13);
}

TEST(LeastSquares, WhatIsNotSeenIsNotDetermined) {
    // x0 + x1 and x2 are seen, x3 not at all.
    MatrixXd a(3, 4);
    a << 1, 1, 0, 0, 2, 2, 0, 0, 0, 0, 5, 0;
    const auto solution = solve_least_squares(a, VectorXd::Ones(3));
    EXPECT_EQ(solution.rank, 2);
    EXPECT_EQ(solution.determined, (std::vector<bool>{false, false, true, false}));
    EXPECT_NEAR(solution.pseudoinverse(2, 2), 0.2, 1e-16);
    EXPECT_LE(solution.pseudoinverse.row(3).norm(), 0.0);
}

TEST(LeastSquares, DeterminedIsWhatEveryNullVectorSpares) {
    for (unsigned seed = 10; seed < 40; ++seed) {
        // Six unknowns, of which a random three-dimensional mixture of four is never seen.
        const MatrixXd hidden = random_matrix(4, 3, seed);
        MatrixXd a = random_matrix(9, 6, seed + 100);
        a.leftCols(4) -= a.leftCols(4) * hidden * (hidden.transpose() * hidden).inverse() * hidden.transpose();
        const auto solution = solve_least_squares(a, VectorXd::Ones(9));
        EXPECT_EQ(solution.rank, 3);
        EXPECT_EQ(solution.determined, (std::vector<bool>{false, false, false, false, true, true})) << seed;
    }
}

TEST(LeastSquares, UncertaintiesWeighAndDoNotDecideTheRank) {
    MatrixXd a(3, 2);
    a << 1, 0, 0, 1, 0, 1;
    const auto solution = solve_least_squares(a, Eigen::Vector3d(1.0, 1e-4, 1e3));
    EXPECT_EQ(solution.rank, 2);
    EXPECT_NEAR(solution.pseudoinverse(1, 1), 1.0, 1e-12);  // weights 1e8 and 1e-6
    EXPECT_NEAR(solution.pseudoinverse(1, 2), 1e-14, 1e-17);
    EXPECT_NEAR(solution.pseudoinverse(0, 0), 1.0, 1e-12);
}

TEST(LeastSquares, NoEquationsDetermineNothing) {
    const auto solution = solve_least_squares(MatrixXd(0, 3), VectorXd(0));
    EXPECT_EQ(solution.rank, 0);
    EXPECT_EQ(solution.determined, (std::vector<bool>{false, false, false}));
    EXPECT_EQ(solution.pseudoinverse.rows(), 3);
    EXPECT_EQ(solution.pseudoinverse.cols(), 0);
}

TEST(LeastSquares, WhatMakesNoEquationsIsRefused) {
    const MatrixXd a = MatrixXd::Ones(2, 2);
    MatrixXd holed = a;
    holed(1, 0) = std::numeric_limits<double>::quiet_NaN();
    expect_refused([&] { solve_least_squares(a, VectorXd::Ones(3)); }, "uncertainty");
    expect_refused([&] { solve_least_squares(a, Eigen::Vector2d(1.0, 0.0)); }, "uncertainty");
    expect_refused([&] { solve_least_squares(a, Eigen::Vector2d(1.0, -1.0)); }, "uncertainty");
    expect_refused([&] { solve_least_squares(a, Eigen::Vector2d(1.0, std::nan(""))); }, "uncertainty");
    expect_refused([&] { solve_least_squares(a, Eigen::Vector2d(1.0, INFINITY)); }, "uncertainty");
    expect_refused([&] { solve_least_squares(holed, VectorXd::Ones(2)); }, "equations");
}
