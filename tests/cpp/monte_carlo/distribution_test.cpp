#include "stepdiag/monte_carlo/distribution.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "stepdiag/core/random.hpp"
#include "stepdiag/core/units.hpp"
#include "support/refuses.hpp"

using namespace stepdiag;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

const std::array<Distribution, 8> every_kind = {{
    {DistributionKind::normal, 3.0, 2.0},
    {DistributionKind::rectangular, 3.0, 2.0},
    {DistributionKind::triangular, 3.0, 2.0},
    {DistributionKind::arcsine, 3.0, 2.0},
    {DistributionKind::student_t, 3.0, 2.0, 18.0},
    {DistributionKind::student_t, 3.0, 2.0, 5.5},
    {DistributionKind::student_t, 3.0, 2.0, infinite},
    {DistributionKind::curvilinear_trapezoid, 3.0, 2.0, infinite, 1.5},
}};

double drawn(const Distribution& distribution, std::uint64_t i) {
    const auto normal = normal_pair(7, RandomStream::verification, RandomBlock{i, 0});
    const auto uniform = uniform_pair(7, RandomStream::verification, RandomBlock{i, 1});
    return draw(distribution, normal[0], uniform[0], uniform[1]);
}

}  // namespace

TEST(Distribution, NumbersDrawnHaveItsExpectationAndStandardUncertainty) {
    constexpr int n = 100'000;
    for (const Distribution& distribution : every_kind) {
        double sum = 0.0, square = 0.0;
        for (int i = 0; i < n; ++i) {
            const double deviation = drawn(distribution, i) - 3.0;
            sum += deviation;
            square += deviation * deviation;
        }
        const double u = distribution.standard_uncertainty();
        EXPECT_NEAR(sum / n, 0.0, 5.0 * u / std::sqrt(n)) << name(distribution.kind);
        // Five standard deviations of a variance: sqrt((kurtosis - 1)/n), kurtosis 7 for 5.5 degrees of freedom.
        EXPECT_NEAR(square / n / (u * u), 1.0, 5.0 * std::sqrt(6.0 / n)) << name(distribution.kind);
    }
}

TEST(Distribution, BoundedKindsStayWithinTheirHalfWidth) {
    for (const Distribution& distribution : every_kind) {
        if (distribution.kind == DistributionKind::normal || distribution.kind == DistributionKind::student_t) continue;
        const double widest = distribution.spread + distribution.edge;
        for (const double u : {1e-16, 0.25, 0.5, 0.75, 1.0 - 1e-16})
            for (const double v : {1e-16, 0.5, 1.0 - 1e-16})
                EXPECT_LE(std::abs(draw(distribution, 0.0, u, v) - 3.0), widest) << name(distribution.kind);
    }
}

TEST(Distribution, SharesBelowAQuantileOfTAreItsProbability) {
    const Distribution t{DistributionKind::student_t, 0.0, 1.0, 5.5};
    constexpr int n = 50'000;
    for (const double p : {0.005, 0.1, 0.5, 0.8, 0.975, 0.999}) {
        int below = 0;
        for (int i = 0; i < n; ++i) below += drawn(t, i) < t_quantile(p, 5.5);
        EXPECT_NEAR(double(below) / n, p, 5.0 * std::sqrt(p * (1.0 - p) / n)) << p;
    }
}

TEST(Distribution, QuantilesAreThoseOfTablesAndClosedForms) {
    EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-14);
    EXPECT_EQ(normal_quantile(0.5), 0.0);
    EXPECT_NEAR(t_quantile(0.975, 9.0), 2.26, 0.005);    // GUM table G.2, two decimals
    EXPECT_NEAR(t_quantile(0.995, 16.0), 2.92, 0.005);   // GUM H.1.6
    for (const double p : {0.001, 0.025, 0.3, 0.975}) {  // closed forms, to a few roundings
        EXPECT_NEAR(t_quantile(p, 1.0) / std::tan(pi * (p - 0.5)), 1.0, 1e-13);
        EXPECT_NEAR(t_quantile(p, 2.0) / ((2.0 * p - 1.0) / std::sqrt(2.0 * p * (1.0 - p))), 1.0, 1e-13);
    }
    EXPECT_EQ(t_quantile(0.975, infinite), normal_quantile(0.975));
}

TEST(Distribution, SpreadOfZeroIsTheExpectationItself) {
    for (Distribution distribution : every_kind) {
        distribution.spread = distribution.edge = 0.0;
        EXPECT_EQ(draw(distribution, 1.3, 0.2, 0.7), 3.0) << name(distribution.kind);
        EXPECT_EQ(distribution.standard_uncertainty(), 0.0);
        EXPECT_NO_THROW(check(distribution, "x"));
    }
}

TEST(Distribution, NamesAreReadBack) {
    for (const Distribution& distribution : every_kind)
        EXPECT_EQ(parse_distribution_kind(name(distribution.kind)), distribution.kind);
    expect_refused([] { parse_distribution_kind("gaussian"); }, "\"gaussian\"");
}

TEST(Distribution, WhatMakesNoSenseIsRefused) {
    const double nan = std::nan("");
    expect_refused([] { check({DistributionKind::normal, 0.0, -1.0}, "x"); }, "x, spread");
    expect_refused([&] { check({DistributionKind::normal, 0.0, nan}, "x"); }, "x, spread");
    expect_refused([&] { check({DistributionKind::normal, infinite, 1.0}, "x"); }, "x, expectation");
    expect_refused([] { check({DistributionKind::normal, 0.0, 1.0, 0.0}, "x"); }, "x, degrees of freedom");
    expect_refused([&] { check({DistributionKind::normal, 0.0, 1.0, nan}, "x"); }, "x, degrees of freedom");
    expect_refused([] { check({DistributionKind::student_t, 0.0, 1.0, 2.0}, "x"); }, "more than 2");
    expect_refused([] { check({DistributionKind::normal, 0.0, 1.0, infinite, 0.5}, "x"); }, "x, edge");
    expect_refused([] { check({DistributionKind::curvilinear_trapezoid, 0.0, 1.0, infinite, 1.5}, "x"); }, "x, edge");
    expect_refused([] { normal_quantile(1.0); }, "probability");
    expect_refused([] { t_quantile(0.5, 0.0); }, "degrees of freedom");
}
