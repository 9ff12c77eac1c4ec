#include "stepdiag/head/spot_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "head/spot_profile.hpp"
#include "stepdiag/core/units.hpp"
#include "support/refuses.hpp"
#include "support/special_numbers.hpp"

namespace {

using Eigen::Vector2d;
using stepdiag::BeamSpot;
using stepdiag::Camera;
using stepdiag::LateralEffect;
using stepdiag::pi;
using stepdiag::test::infinite;
using stepdiag::test::undefined;

double irradiance(double x, double centre, double radius) {
    return std::sqrt(2.0 / pi) / radius * std::exp(-2.0 * std::pow((x - centre) / radius, 2));
}

// Simpson's rule, fine enough to be exact to rounding for what is not much narrower than the interval.
template <class Function>
double integral(const Function& f, double low, double high) {
    constexpr int pieces = 4000;
    const double h = (high - low) / pieces;
    double sum = f(low) + f(high);
    for (int i = 1; i < pieces; ++i) sum += (i % 2 ? 4.0 : 2.0) * f(low + i * h);
    return sum * h / 3.0;
}

}  // namespace

TEST(BeamSpot, RadiusGrowsBySqrtTwoOverTheRayleighLength) {
    const stepdiag::GaussianMode mode{633.0, 0.4, 150.0};
    const double zR = pi * 0.16 / 633e-6;
    EXPECT_NEAR(rayleigh_length(mode), zR, 1e-12);  // roundings
    EXPECT_EQ(beam_radius(mode, 150.0), 0.4);
    EXPECT_NEAR(beam_radius(mode, 150.0 + zR), 0.4 * std::sqrt(2.0), 1e-15);
    EXPECT_NEAR(beam_radius(mode, 150.0 - 1e3 * zR), 0.4 * 1e3, 1e-3);  // the divergence, to second order in 1/1000
}

TEST(BeamSpot, PowerInsideIsTheIntegralOfItsIrradiance) {
    const BeamSpot spot{{0.3, -0.2}, 0.8, 0.37};
    for (const auto& [low, high] :
         {std::pair(Vector2d(-1, -1), Vector2d(1, 1)), std::pair(Vector2d(0.29, -0.4), Vector2d(0.31, 0.9)),
          std::pair(Vector2d(1.5, 0.0), Vector2d(2.0, 0.1))}) {
        const double x = integral([&](double t) { return irradiance(t, 0.3, 0.8); }, low.x(), high.x());
        const double y = integral([&](double t) { return irradiance(t, -0.2, 0.8); }, low.y(), high.y());
        EXPECT_NEAR(power_inside(spot, low, high) / (0.37 * x * y), 1.0, 1e-12);  // Simpson's rule, relative
    }
    EXPECT_NEAR(power_inside(spot, {-20, -20}, {20, 20}), 0.37, 1e-15);
    const double far_tail = power_inside(spot, {8.3, -20}, {20, 20});  // 10 radii off: erfc, not 1 - erf
    EXPECT_NEAR(far_tail / (0.37 * 0.5 * std::erfc(10.0 * std::sqrt(2.0))), 1.0, 1e-12);
}

TEST(BeamSpot, DerivativesOfPixelSharesAreTheirDifferences) {
    const double h = 1e-5, start = -3.0, pitch = 0.5;
    const auto profile = stepdiag::pixel_shares_and_derivatives(0.13, 0.9, start, pitch, 14);
    const auto shares = [&](double centre, double radius) {
        return stepdiag::pixel_shares(centre, radius, start, pitch, 14);
    };
    const Eigen::ArrayXd by_centre = (shares(0.13 + h, 0.9) - shares(0.13 - h, 0.9)) / (2.0 * h);
    const Eigen::ArrayXd by_radius = (shares(0.13, 0.9 + h) - shares(0.13, 0.9 - h)) / (2.0 * h);
    // Third derivatives of about 10 times h^2, and roundings over h.
    EXPECT_LT((profile.col(1) - by_centre).abs().maxCoeff(), 1e-9);
    EXPECT_LT((profile.col(2) - by_radius).abs().maxCoeff(), 1e-9);
}

TEST(LateralEffect, ReadsTheCentroidOfWhatFallsOnIt) {
    LateralEffect device;
    device.size = {4.0, 3.0};
    for (const auto& centre : {Vector2d(0.0, 0.0), Vector2d(1.8, -0.3), Vector2d(-2.4, 1.7)}) {
        const BeamSpot spot{centre, 0.7, 1.0};
        const auto mean = [&](int i) {
            const double half = device.size[i] / 2.0;
            const auto at = [&](double t) { return irradiance(t, centre[i], 0.7); };
            return integral([&](double t) { return t * at(t); }, -half, half) / integral(at, -half, half);
        };
        const auto position = locate(device, {spot}, 0, 0);
        ASSERT_TRUE(position);
        EXPECT_NEAR(position->x(), mean(0), 1e-12);  // Simpson's rule
        EXPECT_NEAR(position->y(), mean(1), 1e-12);
    }
}

TEST(LateralEffect, GhostsPullTheCentroidByTheirPower) {
    const LateralEffect device;
    const auto position = locate(device, {{{0.5, 0.0}, 0.3, 0.9}, {{-2.0, 1.0}, 0.3, 0.1}}, 0, 0);
    EXPECT_NEAR(position->x(), 0.9 * 0.5 - 0.1 * 2.0, 1e-12);  // nothing of them lies off the area
    EXPECT_NEAR(position->y(), 0.1, 1e-12);
}

TEST(LateralEffect, TooLittleLightIsALostReading) {
    const LateralEffect device;
    EXPECT_FALSE(locate(device, {}, 0, 0));
    EXPECT_FALSE(locate(device, {{{0.0, 0.0}, 0.3, 0.9e-6}}, 0, 0));
    EXPECT_TRUE(locate(device, {{{0.0, 0.0}, 0.3, 1.1e-6}}, 0, 0));
    EXPECT_FALSE(locate(device, {{{7.0, 0.0}, 0.3, 1.0}}, 0, 0));  // beside the area
}

TEST(LateralEffect, NoiseGrowsAsPowerFallsAndComesFromSeedAndCounter) {
    LateralEffect device;
    device.noise = 1e-3;
    double square = 0.0;
    constexpr int count = 4000;
    for (int i = 0; i < count; ++i) square += locate(device, {{{0.0, 0.0}, 0.5, 0.1}}, 7, i)->squaredNorm();
    // One sigma of a sample's deviation is 1/sqrt(2 * 8000) of it; five of them.
    EXPECT_NEAR(std::sqrt(square / (2 * count)) / 1e-2, 1.0, 5.0 / std::sqrt(4.0 * count));

    const auto read = [&](int seed, int counter) { return *locate(device, {{{0.0, 0.0}, 0.5, 1.0}}, seed, counter); };
    EXPECT_EQ(read(7, 3), read(7, 3));
    EXPECT_NE(read(7, 3), read(7, 4));
    EXPECT_NE(read(7, 3), read(8, 3));
}

TEST(LateralEffect, PositionIsRoundedToItsResolution) {
    LateralEffect device;
    device.resolution = 0.25;
    const auto position = *locate(device, {{{0.6, -0.9}, 0.3, 1.0}}, 0, 0);
    EXPECT_EQ(position, Vector2d(0.5, -1.0));
}

TEST(LateralEffect, WhatIsOutOfRangeIsRefusedByItsName) {
    const auto change = [](auto edit) {
        LateralEffect device;
        edit(device);
        return [device] { check_lateral_effect(device); };
    };
    for (const double bad : {0.0, -1.0, undefined, infinite}) {
        expect_refused(change([&](auto& d) { d.size.x() = bad; }), "position device size");
        expect_refused(change([&](auto& d) { d.size.y() = bad; }), "position device size");
        expect_refused(change([&](auto& d) { d.least_power = bad; }), "least_power");
    }
    expect_refused(change([&](auto& d) { d.least_power = 1.5; }), "least_power");
    for (const double bad : {-1e-9, undefined, infinite}) {
        expect_refused(change([&](auto& d) { d.noise = bad; }), "noise");
        expect_refused(change([&](auto& d) { d.resolution = bad; }), "resolution");
    }
    EXPECT_NO_THROW(stepdiag::check_lateral_effect({}));
    expect_refused([] { locate(LateralEffect{}, {{{undefined, 0.0}, 0.3, 1.0}}, 0, 0); }, "spot centre x");
    expect_refused([] { locate(LateralEffect{}, {{{0.0, infinite}, 0.3, 1.0}}, 0, 0); }, "spot centre y");
    expect_refused([] { locate(LateralEffect{}, {{{0.0, 0.0}, 0.0, 1.0}}, 0, 0); }, "spot radius");
    expect_refused([] { locate(LateralEffect{}, {{{0.0, 0.0}, 0.3, -1.0}}, 0, 0); }, "spot power");
}
