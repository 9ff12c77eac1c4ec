#include "stepdiag/core/rotation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace {

using LongMatrix = Eigen::Matrix<long double, 3, 3>;

LongMatrix cross_matrix(const Eigen::Vector3d& v) {
    LongMatrix k;
    k << 0.0L, -v.z(), v.y(), v.z(), 0.0L, -v.x(), -v.y(), v.x(), 0.0L;
    return k;
}

// The matrix exponential as its power series in extended precision: shares nothing with Rodrigues' formula.
LongMatrix power_series(const Eigen::Vector3d& v) {
    const LongMatrix k = cross_matrix(v);
    LongMatrix sum = LongMatrix::Identity(), term = LongMatrix::Identity();
    for (int n = 1; n < 80; ++n) {
        term = (term * k / static_cast<long double>(n)).eval();
        sum += term;
    }
    return sum;
}

std::vector<Eigen::Vector3d> vectors_of_length(double length, int count) {
    std::mt19937_64 engine(7);
    std::normal_distribution<double> normal;
    std::vector<Eigen::Vector3d> vectors;
    for (int i = 0; i < count; ++i)
        vectors.push_back(length * Eigen::Vector3d(normal(engine), normal(engine), normal(engine)).normalized());
    return vectors;
}

}  // namespace

TEST(Rotation, ExpEqualsItsPowerSeriesAtEverySize) {
    for (const double length : {0.0, 1e-300, 1e-12, 1e-8, 1e-6, 0.99e-4, 1.01e-4, 1e-3, 0.1, 1.0, 3.1, 3.2}) {
        for (const auto& v : vectors_of_length(length, 50)) {
            const double error =
                (stepdiag::rotation_exp(v).cast<long double>() - power_series(v)).cwiseAbs().maxCoeff();
            EXPECT_LE(error, 1e-15) << "|v| = " << length;  // some roundings of sums of numbers of size 1
        }
    }
}

TEST(Rotation, ExpOfSmallVectorKeepsSecondOrder) {
    for (const double length : {1e-9, 1e-6, 60e-6, 0.999e-4, 1.001e-4, 1e-3}) {
        for (const auto& v : vectors_of_length(length, 50)) {
            const Eigen::Matrix3d r = stepdiag::rotation_exp(v);
            const LongMatrix exact = power_series(v);
            // The symmetric part off the diagonal is purely second order; it is the sum of two entries of size |v|,
            // each rounded to 2^-53 |v|.
            const double symmetric = r(0, 1) + r(1, 0);
            const auto expected = exact(0, 1) + exact(1, 0);
            EXPECT_NEAR(symmetric, static_cast<double>(expected), 4.0 * 0x1p-53 * length) << "|v| = " << length;
        }
    }
}

TEST(Rotation, ExpIsOrthonormalAndRightHanded) {
    for (const double length : {1e-5, 1e-3, 1.0, 3.0}) {
        for (const auto& v : vectors_of_length(length, 20)) {
            const Eigen::Matrix3d r = stepdiag::rotation_exp(v);
            EXPECT_LE((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
                      1e-15);  // a few roundings
            EXPECT_NEAR(r.determinant(), 1.0, 2e-15);
            EXPECT_LE((r * v - v).norm(), 1e-15 * length);  // the axis stays
        }
    }
}

TEST(Rotation, JacobianIsTheDerivativeOfExp) {
    for (const double length : {1e-9, 1e-4, 0.0999, 0.1001, 1.0}) {
        for (const auto& v : vectors_of_length(length, 20)) {
            const Eigen::Matrix3d jacobian = stepdiag::rotation_jacobian(v);
            for (int i = 0; i < 3; ++i) {
                const double step = 1e-5;
                const Eigen::Vector3d dv = step * Eigen::Vector3d::Unit(i);
                const Eigen::Matrix3d turned =
                    stepdiag::rotation_exp(v + dv) * stepdiag::rotation_exp(v - dv).transpose();
                const Eigen::Matrix3d odd = 0.5 * (turned - turned.transpose());  // its second order is symmetric
                const Eigen::Vector3d turn(odd(2, 1), odd(0, 2), odd(1, 0));
                // Lost: step^2 of the third derivative, and 1e-16 over the step.
                EXPECT_LE((jacobian.col(i) - turn / (2.0 * step)).norm(), 1e-9) << "|v| = " << length;
            }
        }
    }
}

TEST(Rotation, QuarterTurnAboutZTakesXToY) {
    const Eigen::Matrix3d r = stepdiag::rotation_exp({0.0, 0.0, std::acos(0.0)});
    EXPECT_LE((r * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);  // pi/2 is rounded
}
