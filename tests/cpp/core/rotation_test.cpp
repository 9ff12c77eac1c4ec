#include "stepdiag/core/rotation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "core/rotation-inl.hpp"

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

// Exp(v + dv) = Exp(J dv) Exp(v), so that dExp = [J dv]x Exp(v).
TEST(Rotation, JacobianIsTheDerivativeOfExpInDualNumbers) {
    using stepdiag::Dual;
    for (const double length : {1e-9, 1e-4, 0.0999, 0.1001, 1.0, 3.0})
        for (const auto& v : vectors_of_length(length, 20)) {
            const Eigen::Matrix3d exp = stepdiag::rotation_exp(v), jacobian = stepdiag::rotation_jacobian(v);
            for (int i = 0; i < 3; ++i) {
                const Eigen::Vector3d unit = Eigen::Vector3d::Unit(i);
                const auto turned = rotation_exp(stepdiag::STEPDIAG_NAMESPACE::Vector3<Dual>{
                    {v.x(), unit.x()}, {v.y(), unit.y()}, {v.z(), unit.z()}});
                Eigen::Matrix3d slope;
                slope << turned.row0.x.slope, turned.row0.y.slope, turned.row0.z.slope, turned.row1.x.slope,
                    turned.row1.y.slope, turned.row1.z.slope, turned.row2.x.slope, turned.row2.y.slope,
                    turned.row2.z.slope;
                const Eigen::Matrix3d expected = cross_matrix(jacobian.col(i)).cast<double>() * exp;
                // Quotients by the angle lose up to its inverse, and the series end there at 1e-16.
                EXPECT_LE((slope - expected).cwiseAbs().maxCoeff(), 1e-14) << "|v| = " << length;
            }
        }
}

TEST(Rotation, QuarterTurnAboutZTakesXToY) {
    const Eigen::Matrix3d r = stepdiag::rotation_exp({0.0, 0.0, std::acos(0.0)});
    EXPECT_LE((r * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);  // pi/2 is rounded
}
