// What second-order errors of angles add to the uncertainty of lengths: intervals of 95 % hold 95 % of them.
#include "adjustment/setup_priors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stepdiag/plan/line.hpp"

namespace {

using stepdiag::AdjustmentOptions;
using stepdiag::HeadLayout;
using stepdiag::LineReadings;
using stepdiag::SetupQuantity;

constexpr int draws = 400'000;
// A binomial share of 400,000 has a standard deviation of 0.00034: five of them.
constexpr double chance = 0.0017;

double scale_factor(HeadLayout layout, bool is_scale_line, const LineReadings& readings, double laser,
                    std::optional<double> mirror) {
    stepdiag::HeadCalibration head;
    head.psd_distance = 50.0;
    if (layout == HeadLayout::multi_beam) head.beam_offsets = {{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}};
    const stepdiag::ChannelModel model(layout, head, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    AdjustmentOptions options;
    auto& own = options.setup_by_line["p00"];
    own[static_cast<std::size_t>(SetupQuantity::laser)] = laser;
    own[static_cast<std::size_t>(SetupQuantity::reflector)] = mirror;
    return stepdiag::setup_priors(options, "p00", is_scale_line, readings, model)[stepdiag::setup::scale_factor];
}

LineReadings readings(bool tilts, double tilt = 0.0, std::array<bool, 2> beside = {}) {
    LineReadings of{tilts, false, beside};
    of.tilt = tilt;
    return of;
}

// Share of errors within 1.96 u; error: of four independent standard normal numbers.
template <typename Error>
double covered(double u, Error error) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    int within = 0;
    for (int i = 0; i < draws; ++i) {
        const double z[] = {normal(random), normal(random), normal(random), normal(random)};
        within += std::abs(error(z)) <= 1.959963984540054 * u;
    }
    return double(within) / draws;
}

// Too long by travel, in one direction.
double second_order(double difference, double mirror) { return 1.5 * difference * difference - mirror * mirror / 2.0; }

TEST(SetupPriors, ContainTheMirrorThatFollowsALaser) {
    for (const double laser : {100e-6, 500e-6}) {
        const double u = scale_factor(HeadLayout::ideal, true, readings(true), laser, std::nullopt);
        EXPECT_NEAR(u, 1.5284 * laser * laser, 1e-4 * u);  // -ln(0.05)/1.96
        const double share = covered(
            u, [&](const double* z) { return second_order(0.0, laser * z[0]) + second_order(0.0, laser * z[1]); });
        EXPECT_NEAR(share, 0.95, chance);
    }
}

TEST(SetupPriors, ContainTheLaserOfAMirrorWhoseTiltIsRead) {
    const double laser = 250e-6;
    for (const double tilt : {50e-6, 150e-6, 250e-6, 350e-6, 500e-6, 1e-3, 2e-3, 5e-3}) {
        const double u = scale_factor(HeadLayout::psd, true, readings(true, tilt), laser, std::nullopt);
        const double share = covered(u, [&](const double* z) {
            const double a = laser * z[0], b = laser * z[1];
            return second_order(tilt, tilt + a) - tilt * tilt + second_order(0.0, b);
        });
        EXPECT_GE(share, 0.949 - chance) << tilt;  // the rule is fitted
        EXPECT_LE(share, 0.954 + chance) << tilt;
    }
}

TEST(SetupPriors, ContainTheMirrorOfAScaleLineThatNoReadingTells) {
    struct Angles {
        double laser, mirror;
    };
    for (const auto [laser, mirror] : {Angles{250e-6, 300e-6},
                                       {500e-6, 500e-6},
                                       {500e-6, 50e-6},
                                       {50e-6, 500e-6},
                                       {500e-6, 0.0},
                                       {0.0, 500e-6},
                                       {1e-9, 2e-3}}) {
        for (const auto layout : {HeadLayout::multi_beam, HeadLayout::ideal}) {
            const LineReadings told = readings(layout == HeadLayout::multi_beam);
            const double u = scale_factor(layout, true, told, laser, mirror);
            const double share = covered(u, [s = laser, m = mirror](const double* z) {  // clang 14 captures no bindings
                const double d[] = {m * z[0], m * z[1]}, l[] = {s * z[2], s * z[3]};
                return second_order(d[0], d[0] + l[0]) + second_order(d[1], d[1] + l[1]);
            });
            EXPECT_NEAR(share, 0.95, chance) << laser << " " << mirror;
        }
    }
}

TEST(SetupPriors, TakeTheMirrorOfSuchALineForKnownTo500MicroradiansUnlessTold) {
    const LineReadings beams = readings(true);
    const double usual = scale_factor(HeadLayout::multi_beam, true, beams, 250e-6, std::nullopt);
    EXPECT_EQ(usual, scale_factor(HeadLayout::multi_beam, true, beams, 250e-6, 500e-6));
    const double free = scale_factor(HeadLayout::multi_beam, true, beams, 250e-6, stepdiag::free_unknown);
    EXPECT_EQ(free, scale_factor(HeadLayout::multi_beam, true, beams, 250e-6, 2e-3));
}

TEST(SetupPriors, ContainTheAnglesOfMeasuredLines) {
    const double laser = 1e-3, mirror = 2e-3, variance = 1.0 / (std::pow(laser, -2) + std::pow(mirror, -2));
    const double single = scale_factor(HeadLayout::ideal, false, readings(true), laser, mirror);
    EXPECT_NEAR(covered(single, [&](const double* z) { return variance * (z[0] * z[0] + z[1] * z[1]) / 2.0; }), 0.95,
                chance);
    const double face = scale_factor(HeadLayout::ideal, false, readings(true, 0.0, {true, false}), laser, mirror);
    EXPECT_NEAR(covered(face, [&](const double* z) { return variance * z[0] * z[0] / 2.0; }), 0.95, chance);
    EXPECT_EQ(scale_factor(HeadLayout::ideal, false, readings(true, 0.0, {true, true}), laser, mirror), 0.0);
    const double untold = scale_factor(HeadLayout::multi_beam, false, readings(true), laser, std::nullopt);
    EXPECT_NEAR(
        covered(untold,
                [&](const double* z) { return second_order(laser * z[0], 0.0) + second_order(laser * z[1], 0.0); }),
        0.95, chance);
}

}  // namespace
