#include "evaluation/fit_test.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "evaluation/least_squares.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Two independent values of 1 and 2 standard deviations, in units that are six decades apart, and their sum.
TEST(FitTest, ChiSquareCountsWhatDependsOnOthersOnce) {
    MatrixXd share(3, 2);
    share << 1.0, 0.0, 0.0, 1e-6, 1e6, 1.0;
    const VectorXd values = share * Eigen::Vector2d(1.0, 2.0);
    const stepdiag::ChiSquare test = stepdiag::chi_square(values, share * share.transpose());
    EXPECT_EQ(test.freedom, 2);
    EXPECT_NEAR(test.square_sum, 5.0, 1e-6);
}

TEST(FitTest, WithoutContradictionsNothingIsChecked) {
    EXPECT_EQ(stepdiag::fit_of_noise(0.0, 0), stepdiag::Fit::unchecked);
    EXPECT_EQ(stepdiag::chi_square(VectorXd(), MatrixXd()).freedom, 0);
}

// Tables of chi-square: 18.307 and 23.209 for 10 degrees of freedom at 5 % and 1 %.
TEST(FitTest, ProbabilitiesAreThoseOfTheTables) {
    EXPECT_NEAR(stepdiag::chi_square_probability(18.307, 10), 0.05, 1e-5);
    EXPECT_EQ(stepdiag::fit_of_noise(23.2, 10), stepdiag::Fit::accepted);
    EXPECT_EQ(stepdiag::fit_of_noise(23.3, 10), stepdiag::Fit::doubtful);
    EXPECT_EQ(stepdiag::fit_of_noise(1.4, 10), stepdiag::Fit::doubtful);  // 99.9 % are above 1.479
    EXPECT_EQ(stepdiag::fit_of_noise(90.1, 10), stepdiag::Fit::rejected);
}

// SciPy's ncx2, solved for the noncentrality.
TEST(FitTest, NoncentralityIsThatOfTheNoncentralDistribution) {
    EXPECT_NEAR(stepdiag::noncentrality(1, 0.001, 0.95), 24.3579792825, 1e-7);
    EXPECT_NEAR(stepdiag::noncentrality(6, 0.001, 0.95), 34.9192884454, 1e-7);
    EXPECT_NEAR(stepdiag::noncentrality(21, 0.001, 0.95), 49.5931035576, 1e-7);
    EXPECT_NEAR(stepdiag::noncentrality(3, 0.05, 0.8), 10.9025632901, 1e-7);
    EXPECT_EQ(stepdiag::noncentrality(0, 0.05, 0.8), std::numeric_limits<double>::infinity());
}

TEST(FitTest, SharesAddUpAcrossBlocks) {
    const MatrixXd shares = MatrixXd::Random(5, 150);
    stepdiag::ShareSum sum(5);
    for (Eigen::Index c = 0; c < shares.cols(); ++c) sum.add([&](std::size_t i) { return shares(Eigen::Index(i), c); });
    EXPECT_LT((sum.matrix() - shares * shares.transpose()).norm(), 1e-12);
}

TEST(LeastSquares, ContradictionsAreSumsOfEquationsWhoseLeftSidesCancel) {
    const MatrixXd equations = MatrixXd::Random(6, 3);
    const VectorXd uncertainty = VectorXd::Random(6).array() + 2.0;
    const auto solution = stepdiag::solve_least_squares(equations, uncertainty);
    ASSERT_EQ(solution.contradictions.rows(), 3);
    const MatrixXd contradictions = solution.contradictions.matrix();
    EXPECT_LT((contradictions * equations).norm(), 1e-13);
    EXPECT_EQ(Eigen::FullPivLU<MatrixXd>(contradictions).rank(), 3);
}

TEST(LeastSquares, RowsOfContradictionsAreTheSameForFewAndManyEquations) {
    for (const int count : {6, 400}) {
        const MatrixXd equations = MatrixXd::Random(count, 3);
        const VectorXd uncertainty = VectorXd::Random(count).array() + 2.0;
        const auto solution = stepdiag::solve_least_squares(equations, uncertainty);
        const MatrixXd all = solution.contradictions.matrix();
        EXPECT_LT((all * equations).norm(), 1e-12);
        VectorXd space;
        for (Eigen::Index i = 0; i < all.rows(); ++i) {
            const Eigen::Map<const VectorXd> row(solution.contradictions.row(i, space), count);
            EXPECT_EQ(VectorXd(all.row(i)), VectorXd(row));
        }
    }
}

}  // namespace
