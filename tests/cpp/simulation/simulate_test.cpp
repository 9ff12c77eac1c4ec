#include "stepdiag/simulation/simulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "refuses.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Chain;
using stepdiag::Head;
using stepdiag::HeadLayout;
using stepdiag::Line;
using stepdiag::Machine;
using stepdiag::Misalignment;
using stepdiag::Plan;
using stepdiag::SimulationOptions;

const Vector3d volume(800.0, 600.0, 500.0);

Machine machine() {
    stepdiag::RandomErrorMap options;
    options.seed = 4;
    return Machine(Chain::parse("[w X' b Y Z t]"), stepdiag::make_random_error_map(volume, options), {5.0, -3.0, 70.0});
}

Plan plan(int steps = 10) {
    return Plan(volume, {Line::parse("ppp"), Line::parse("nnp")}, steps, stepdiag::all_axes, {Line::parse("p00")});
}

}  // namespace

TEST(Simulate, RowsAreThePlansPointsInOrder) {
    const auto run = simulate(machine(), plan(), Head{});
    ASSERT_EQ(run.size(), 31u + 31u + 2u);
    EXPECT_EQ(run.stations()[0].line.name(), "ppp");
    EXPECT_EQ(run.stations()[31].line.name(), "nnp");
    EXPECT_EQ(run.stations()[63].line.name(), "p00");
    EXPECT_EQ(run.stations()[63].point, 1);
    EXPECT_EQ(run.stations()[63].commanded, Vector3d(800, 0, 0));
    for (const auto& channel : run.channels())
        for (const auto& value : channel.value) EXPECT_TRUE(value);
}

TEST(Simulate, PerfectMachineReadsTheTravelAlongTheLine) {
    const Machine perfect(Chain::parse("[w b X Y Z t]"), {}, {1.0, 2.0, 3.0});
    const auto run = simulate(perfect, plan(), Head{});
    const auto f = plan().frame(Line::parse("ppp"));
    for (int k = 0; k < 31; ++k)
        EXPECT_NEAR(*run.find("distance")->value[k], 100.0 + f.col(2).dot(run.stations()[k].commanded), 2e-12);
}

TEST(Simulate, NoiseHasTheStandardDeviationAskedFor) {
    const Plan fine = plan(400);
    for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam}) {
        Head head;
        head.layout = layout;
        head.psd_distance = 50.0;
        if (layout == HeadLayout::multi_beam) head.beam_offsets = {{0, 0}, {20, 0}, {0, 20}};
        SimulationOptions options;
        const auto clean = simulate(machine(), fine, head, options);
        options.noise = {1e-4, 2e-6, 3e-3, 99};
        const auto noisy = simulate(machine(), fine, head, options);
        for (const auto& channel : noisy.channels()) {
            double sum = 0.0;
            for (std::size_t i = 0; i < noisy.size(); ++i)
                sum += std::pow(*channel.value[i] - *clean.find(channel.name)->value[i], 2);
            const double sigma = channel.name == "alpha" || channel.name == "beta" ? 2e-6
                                 : channel.name[0] == 's'                          ? 3e-3
                                                                                   : 1e-4;
            // 2,404 readings: the standard deviation of a standard deviation is 1.4 %; five of them.
            EXPECT_NEAR(std::sqrt(sum / double(noisy.size())) / sigma, 1.0, 0.07) << channel.name;
        }
    }
}

TEST(Simulate, NoiseRepeatsWithItsSeedAndDiffersWithout) {
    SimulationOptions options;
    options.noise = {1e-4, 1e-6, 0.0, 7};
    const auto run = [&] { return simulate(machine(), plan(), Head{}, options).find("distance")->value; };
    const auto first = run();
    EXPECT_EQ(run(), first);
    options.noise.seed = 8;
    EXPECT_NE(run(), first);
}

TEST(Simulate, RefractiveIndexIsTakenOffAgain) {
    SimulationOptions air;
    air.environment = stepdiag::Environment{1.000268};
    const auto vacuum = simulate(machine(), plan(), Head{}), in_air = simulate(machine(), plan(), Head{}, air);
    for (std::size_t i = 0; i < vacuum.size(); ++i)
        EXPECT_NEAR(*vacuum.find("distance")->value[i], *in_air.find("distance")->value[i],
                    1e-12);  // a product, a quotient
}

TEST(Simulate, ReadingsBesideASmallMirrorAreLost) {
    Head head;
    head.mirror = plan().smallest_mirror();  // holds the nominal beam; 5 mrad of laser at 1.2 m takes it 6 mm away
    SimulationOptions options;
    options.misalignment["ppp"] = {{0, 0}, {5e-3, 5e-3}, {0, 0}};
    const auto run = simulate(machine(), plan(), head, options);
    std::size_t lost = 0;
    for (const auto& value : run.find("distance")->value) lost += !value;
    EXPECT_GT(lost, 0u);
    EXPECT_LT(lost, run.size());
    EXPECT_EQ(run.size(), 64u);
    for (const char* channel : {"alpha", "beta"})
        for (std::size_t i = 0; i < run.size(); ++i)
            EXPECT_EQ(run.find(channel)->value[i].has_value(), run.find("distance")->value[i].has_value());
}

TEST(Simulate, WhatMakesNoSenseIsRefusedByName) {
    constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
    const auto with = [](auto edit) {
        Head head;
        SimulationOptions options;
        edit(head, options);
        return [head, options] { simulate(machine(), plan(), head, options); };
    };
    using Options = SimulationOptions;
    expect_refused(with([](Head& h, Options&) { h.mirror = Vector2d(10.0, 10.0); }), "mirror");
    expect_refused(with([](Head& h, Options&) { h.standoff = -1.0; }), "standoff");
    expect_refused(with([](Head&, Options& o) { o.misalignment["pnp"] = {}; }), "pnp");
    expect_refused(with([](Head&, Options& o) { o.misalignment["what"] = {}; }), "what");
    for (const double angle : {0.1, -0.2, undefined, double(INFINITY)})
        for (const Vector2d& pair : {Vector2d(angle, 0.0), Vector2d(0.0, angle), Vector2d(angle, angle)}) {
            expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].reflector = pair; }), "ppp");
            expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].laser = pair; }), "ppp");
        }
    expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].psd_zero = {undefined, 0.0}; }), "ppp");
    for (const double sigma : {-1.0, undefined, double(INFINITY)}) {
        expect_refused(with([&](Head&, Options& o) { o.noise.distance = sigma; }), "noise");
        expect_refused(with([&](Head&, Options& o) { o.noise.tilt = sigma; }), "noise");
        expect_refused(with([&](Head&, Options& o) { o.noise.spot = sigma; }), "noise");
    }
    for (const double index : {0.99, 0.0, -1.0, undefined, double(INFINITY)})
        expect_refused(with([&](Head&, Options& o) { o.environment = stepdiag::Environment{index}; }),
                       "refractive_index");
}
