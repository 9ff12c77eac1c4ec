#include "adjustment/bordered_band.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <random>
#include <string>

#include "adjustment/normal_equations.hpp"
#include "stepdiag/core/instruction_set.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using stepdiag::BorderedBand;
using stepdiag::BorderedFactor;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double threshold = 1e-11;

std::vector<int> random_reach(int blocks, int most, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<int> reach(blocks);
    for (int j = 0, last = 0; j < blocks; ++j)
        reach[j] = last = std::min(blocks - 1, std::max(last, j + int(engine() % (most + 1))));
    return reach;
}

// The whole symmetric matrix; elements outside the pattern are 0.
MatrixXd dense(const BorderedBand& matrix) {
    const int band = 6 * matrix.blocks(), border = matrix.border();
    MatrixXd all = MatrixXd::Zero(matrix.size(), matrix.size());
    for (int j = 0; j < matrix.blocks(); ++j) {
        for (int i = j; i <= matrix.reach(j); ++i) all.block(6 * i, 6 * j, 6, 6) = matrix.block(i, j);
        all.block(band, 6 * j, border, 6) = matrix.border_rows(j);
    }
    all.bottomRightCorner(border, border) = matrix.corner();
    return all.selfadjointView<Eigen::Lower>();
}

// J^T J of random readings: each sees one block or two coupled ones, and the border. `restrict` changes a row of J.
template <class Restrict>
BorderedBand random_normal_matrix(const std::vector<int>& reach, int border, unsigned seed, Restrict restrict) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    BorderedBand matrix(reach, border);
    const auto add_reading = [&](const std::vector<int>& blocks) {
        VectorXd row = VectorXd::Zero(matrix.size());
        for (const int block : blocks)
            row.segment<6>(6 * block) = VectorXd::NullaryExpr(6, [&] { return normal(engine); });
        row.tail(border) = VectorXd::NullaryExpr(border, [&] { return normal(engine); });
        restrict(row);
        for (const int i : blocks) {
            for (const int j : blocks)
                if (i >= j) matrix.block(i, j) += row.segment<6>(6 * i) * row.segment<6>(6 * j).transpose();
            matrix.border_rows(i) += row.tail(border) * row.segment<6>(6 * i).transpose();
        }
        matrix.corner() += row.tail(border) * row.tail(border).transpose();
    };
    for (int j = 0; j < matrix.blocks(); ++j) {
        for (int i = j + 1; i <= reach[j]; ++i) add_reading({i, j}), add_reading({i, j});
        for (int times = 0; times < 10; ++times) add_reading({j});
    }
    for (int times = 0; times < border; ++times) add_reading({});
    return matrix;
}

BorderedBand random_normal_matrix(const std::vector<int>& reach, int border, unsigned seed) {
    return random_normal_matrix(reach, border, seed, [](VectorXd&) {});
}

VectorXd random_vector(Eigen::Index size, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    return VectorXd::NullaryExpr(size, [&] { return normal(engine); });
}

double condition(const MatrixXd& matrix) {
    if (matrix.rows() == 0) return 1.0;
    const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
    return values.maxCoeff() / values.minCoeff();
}

// Without the rows and columns that are held.
MatrixXd kept_inverse(const MatrixXd& matrix, const std::vector<int>& held, double& cond) {
    std::vector<int> kept;
    for (int i = 0; i < matrix.rows(); ++i)
        if (!std::binary_search(held.begin(), held.end(), i)) kept.push_back(i);
    const MatrixXd part = matrix(kept, kept);
    cond = condition(part);
    MatrixXd inverse = MatrixXd::Zero(matrix.rows(), matrix.rows());
    inverse(kept, kept) = MatrixXd(part.llt().solve(MatrixXd::Identity(part.rows(), part.rows())));
    return inverse;
}

// Right sides beside each other have the answers of each alone, but for the order of sums.
void expect_same_beside_each_other(const BorderedFactor& factor, const MatrixXd& inverse, double tolerance) {
    const int size = int(inverse.rows());
    BorderedFactor::Sides right(size, BorderedFactor::sides);
    for (int k = 0; k < BorderedFactor::sides; ++k) right.col(k) = random_vector(size, 20 + k);
    BorderedFactor::Sides x = right;
    factor.solve(x);
    const BorderedFactor::OfSides squares = factor.inverse_squares(right);
    for (int k = 0; k < BorderedFactor::sides; ++k) {
        const VectorXd side = right.col(k);
        VectorXd alone = side;
        factor.solve(alone);
        const double scale = side.lpNorm<1>();
        EXPECT_LE((x.col(k) - alone).lpNorm<Eigen::Infinity>(), tolerance * scale);
        EXPECT_NEAR(squares[k], side.dot(inverse * side), tolerance * scale * scale);
    }
}

void expect_dense_answers(const BorderedBand& matrix, const BorderedFactor& factor) {
    double cond;
    const MatrixXd inverse = kept_inverse(dense(matrix), factor.held(), cond);
    // Roundings of eps cond, relative to the inverse.
    const double tolerance = 10.0 * epsilon * cond * inverse.lpNorm<Eigen::Infinity>();
    const VectorXd right = random_vector(matrix.size(), 7);
    VectorXd x = right;
    factor.solve(x);
    EXPECT_LE((x - inverse * right).lpNorm<Eigen::Infinity>(), tolerance * right.lpNorm<1>());
    for (const int i : factor.held()) EXPECT_EQ(x[i], 0.0);
    if (matrix.size() > 0) expect_same_beside_each_other(factor, inverse, tolerance);

    const BorderedBand selected = factor.selected_inverse();
    for (int j = 0; j < matrix.blocks(); ++j) {
        for (int i = j; i <= matrix.reach(j); ++i) {
            const auto difference = selected.block(i, j) - inverse.block(6 * i, 6 * j, 6, 6);
            EXPECT_LE(difference.cwiseAbs().maxCoeff(), tolerance) << i << ", " << j;
        }
        if (matrix.border() == 0) continue;
        const auto difference = selected.border_rows(j) - inverse.block(6 * matrix.blocks(), 6 * j, matrix.border(), 6);
        EXPECT_LE(difference.cwiseAbs().maxCoeff(), tolerance);
    }
    if (matrix.border() > 0) {
        const auto difference = selected.corner() - inverse.bottomRightCorner(matrix.border(), matrix.border());
        EXPECT_LE(difference.cwiseAbs().maxCoeff(), tolerance);
    }
}

}  // namespace

TEST(BorderedBand, FactorSolutionAndInverseAreThoseOfTheDenseMatrix) {
    for (const int border : {0, 1, 7, 71})
        for (const int blocks : {0, 1, 2, 5, 23})
            for (const int most : {0, 1, 3, 9}) {
                SCOPED_TRACE(testing::Message() << border << " rows, " << blocks << " blocks, reach " << most);
                const auto matrix = random_normal_matrix(random_reach(blocks, most, 5), border, 1);
                const BorderedFactor factor(matrix, threshold);
                EXPECT_TRUE(factor.held().empty());
                expect_dense_answers(matrix, factor);
            }
}

TEST(BorderedBand, UnobservedUnknownIsHeld) {
    const auto blind = [](VectorXd& row) { row[20] = row[6 * 9 + 4] = 0.0; };
    const auto matrix = random_normal_matrix(random_reach(9, 3, 1), 7, 2, blind);
    const BorderedFactor factor(matrix, threshold);
    EXPECT_EQ(factor.held(), (std::vector<int>{20, 6 * 9 + 4}));
    expect_dense_answers(matrix, factor);
}

TEST(BorderedBand, UnknownThatDependsOnThoseBeforeItIsHeld) {
    const auto repeat = [](VectorXd& row) { row[17] = row[13] + 2.0 * row[16]; };
    const auto matrix = random_normal_matrix(random_reach(9, 3, 1), 7, 2, repeat);
    const BorderedFactor factor(matrix, threshold);
    EXPECT_EQ(factor.held(), std::vector<int>{17});
    expect_dense_answers(matrix, factor);
}

TEST(BorderedBand, CommonShiftOfAllBlocksHoldsTheLast) {  // readings see differences only
    const int blocks = 12;
    std::vector<int> reach(blocks, blocks - 1);
    for (int j = 0; j < blocks - 2; ++j) reach[j] = j + 2;
    const auto difference = [](VectorXd& row) {
        double sum = 0.0;
        int last = 0;
        for (int j = 0; j < blocks; ++j)
            if (row[6 * j] != 0.0) sum += row[6 * j], last = j;
        row[6 * last] -= sum;
    };
    const auto matrix = random_normal_matrix(reach, 3, 4, difference);
    const BorderedFactor factor(matrix, threshold);
    EXPECT_EQ(factor.held(), std::vector<int>{6 * (blocks - 1)});
    expect_dense_answers(matrix, factor);
}

TEST(BorderedBand, CornerHoldsAsManyAsDepend) {
    const int blocks = 9, border = 60;  // more than a panel of the corner
    for (const double scale : {1.0, 1e-6}) {
        // One row of the border depends on others, another one on the band.
        const auto repeat = [&](VectorXd& row) {
            auto rest = row.tail(border);
            rest[5] = rest[0] - rest[57];
            rest[30] = 0.0;
            for (int j = 0; j < blocks; ++j) rest[30] += row[6 * j + 2];
            rest[57] *= scale;  // rank does not depend on units
        };
        const auto matrix = random_normal_matrix(random_reach(blocks, 3, 1), border, 2, repeat);
        const BorderedFactor factor(matrix, threshold);
        const auto held = [&](int row) {
            return std::binary_search(factor.held().begin(), factor.held().end(), 6 * blocks + row);
        };
        EXPECT_EQ(factor.held().size(), 2u);
        EXPECT_TRUE(held(30));
        EXPECT_TRUE(held(0) || held(5) || held(57));
        expect_dense_answers(matrix, factor);
    }
}

TEST(BorderedBand, FactorIsMadeAgainInPlace) {
    const auto reach = random_reach(23, 5, 1);
    const auto matrix = random_normal_matrix(reach, 7, 1), other = random_normal_matrix(reach, 7, 2);
    BorderedFactor factor(other, threshold);
    const VectorXd right = random_vector(matrix.size(), 3);
    VectorXd again = right, moved = right, once = right;
    BorderedFactor(matrix, threshold).solve(once);
    factor.factorize(matrix);
    factor.solve(again);
    EXPECT_EQ(again, once);
    factor.factorize(other);
    factor.factorize(BorderedBand(matrix));
    factor.solve(moved);
    EXPECT_EQ(moved, once);
    auto inverse = BorderedFactor(other, threshold).selected_inverse();
    factor.selected_inverse(inverse);
    EXPECT_EQ(dense(inverse), dense(BorderedFactor(matrix, threshold).selected_inverse()));
}

TEST(BorderedBand, DiagonalBlocksMayBeFilledBeyondTheirTriangle) {
    const auto matrix = random_normal_matrix(random_reach(23, 5, 1), 7, 1);
    auto upper = matrix;
    for (int j = 0; j < matrix.blocks(); ++j) upper.block(j, j).triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
    upper.corner().triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
    EXPECT_EQ(dense(upper), dense(matrix));
    EXPECT_EQ(upper.diagonal(), dense(matrix).diagonal());
    EXPECT_EQ(dense(BorderedFactor(upper, threshold).selected_inverse()),
              dense(BorderedFactor(matrix, threshold).selected_inverse()));
}

// Readings of leaf after leaf, each of all blocks, the border and its leaf: N, dense and on its pattern. In `restrict`
// columns of J may be changed.
struct Leafy {
    static constexpr int blocks = 5, first = 2, border = 7;
    const std::vector<int> size{3, 0, 12, 1, 2, 40, 5};
    MatrixXd all;
    BorderedBand matrix{std::vector<int>(blocks, blocks - 1), border, {first, size}};

    template <class Restrict>
    explicit Leafy(Restrict restrict) {
        std::mt19937 engine(3);
        std::normal_distribution<double> normal;
        all = MatrixXd::Zero(matrix.size(), matrix.size());
        for (int leaf = 0; leaf < int(size.size()); ++leaf)
            for (int reading = 0; reading < 60; ++reading) {
                VectorXd row = VectorXd::NullaryExpr(matrix.size(), [&] { return normal(engine); });
                for (int j = 0; j < matrix.size(); ++j)
                    if (const int place = matrix.leaf_place(j); place >= 0 && matrix.leaf_of(place) != leaf)
                        row[j] = 0.0;
                restrict(row);
                all += row * row.transpose();
            }
        for (int i = 0; i < matrix.size(); ++i)
            for (int j = 0; j <= i; ++j)
                if (on_pattern(i, j)) stepdiag::element(matrix, i, j) = all(i, j);
    }
    bool on_pattern(int i, int j) const {
        const int a = matrix.leaf_place(i), b = matrix.leaf_place(j);
        return a < 0 || b < 0 || matrix.leaf_of(a) == matrix.leaf_of(b);
    }
    void expect_dense_answers(const std::vector<int>& held) const {
        const BorderedFactor factor(matrix, threshold);
        EXPECT_EQ(factor.held(), held);
        double cond;
        const MatrixXd inverse = kept_inverse(all, factor.held(), cond);
        const double tolerance = 10.0 * epsilon * cond * inverse.lpNorm<Eigen::Infinity>();
        VectorXd right = random_vector(matrix.size(), 7), x = right;
        factor.solve(x);
        EXPECT_LE((x - inverse * right).lpNorm<Eigen::Infinity>(), tolerance * right.lpNorm<1>());
        for (const int i : factor.held()) EXPECT_EQ(x[i], 0.0);
        expect_same_beside_each_other(factor, inverse, tolerance);
        const BorderedBand selected = factor.selected_inverse();
        for (int i = 0; i < matrix.size(); ++i)
            for (int j = 0; j <= i; ++j)
                if (on_pattern(i, j)) {
                    EXPECT_NEAR(stepdiag::element(selected, i, j), inverse(i, j), tolerance) << i << ", " << j;
                }
        EXPECT_EQ(matrix.diagonal(), VectorXd(all.diagonal()));
    }
};

TEST(BorderedBand, LeavesGiveTheAnswersOfTheDenseMatrix) {
    Leafy([](VectorXd&) {}).expect_dense_answers({});
}

TEST(BorderedBand, UnknownsOfLeavesThatNothingTellsAreHeld) {
    constexpr int unobserved = 6 * Leafy::blocks + Leafy::first + 4, node = 8;
    Leafy([](VectorXd& row) { row[unobserved] = row[node] = 0.0; }).expect_dense_answers({node, unobserved});
}

TEST(BorderedBand, BorderThatDependsOnLeavesIsHeld) {
    // The sum of an unknown of each leaf that has readings.
    constexpr int last = 6 * Leafy::blocks + Leafy::first + 63 + Leafy::border - Leafy::first - 1;
    const Leafy leafy([](VectorXd& row) {
        row[last] = 0.0;
        for (int place : {0, 3, 15, 16, 18, 58}) row[last] += row[6 * Leafy::blocks + Leafy::first + place];
    });
    // Leaf 1 has no unknown: its readings see 0.
    leafy.expect_dense_answers({last});
}

TEST(BorderedBand, AllInstructionSetsAgreeToRounding) {
    const auto matrix = random_normal_matrix(random_reach(23, 9, 1), 71, 1);
    const std::string chosen = stepdiag::instruction_set();  // chosen for all of the library at once
    for (const std::string& name : stepdiag::instruction_sets()) {
        SCOPED_TRACE(name);
        stepdiag::choose_instruction_set(name);
        expect_dense_answers(matrix, BorderedFactor(matrix, threshold));
    }
    stepdiag::choose_instruction_set(chosen);
}
