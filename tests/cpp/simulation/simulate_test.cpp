#include "stepdiag/simulation/simulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "simulation/two_diagonals.hpp"
#include "support/refuses.hpp"
#include "support/traced_mirror.hpp"
#include "support/usual.hpp"

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
using stepdiag::test::chain;
using stepdiag::test::volume;
using stepdiag::test::two_diagonals::machine;
using stepdiag::test::two_diagonals::plan;

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

TEST(Simulate, RunsOfRandomMachinesAreTraced) {
    std::mt19937_64 engine(8);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto pair = [&](double size) { return Vector2d(size * unit(engine), size * unit(engine)); };
    for (const char* chain : {"[w X' b Y Z t]", "[w b Z X Y t]", "[w Z' Y' X' b t]"})
        for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam}) {
            stepdiag::RandomErrorMap errors;
            errors.seed = engine();
            const Machine random(Chain::parse(chain), stepdiag::make_random_error_map(volume, errors),
                                 {5.0, -3.0, 70.0});
            Head head;
            head.layout = layout;
            head.psd_distance = 50.0;
            head.mirror = Vector2d(220.0, 220.0);
            if (layout == HeadLayout::multi_beam) head.beam_offsets = {{0, 1}, {20, 0}, {0, 20}, {-15, -15}};
            SimulationOptions options;
            for (const char* line : {"ppp", "nnp", "p00"})
                options.misalignment[line] = {pair(1e-3), pair(1e-3), Vector2d::Zero(),   0.0,
                                              {},         pair(2.0),  0.05 * unit(engine)};
            options.backward = true;
            const auto run = simulate(random, plan(), head, options);
            const auto names = signal_names(head);
            for (std::size_t i = 0; i < run.size(); ++i) {
                const auto& station = run.stations()[i];
                const Vector3d first = plan().points(station.line).front().commanded + random.tool();
                const auto setup = set_up(head, plan().frame(station.line), first, *head.mirror,
                                          options.misalignment[station.line.name()]);
                const auto pose = random.pose(station.commanded, approaches(station.line, station.direction));
                const auto traced = stepdiag::test::trace_signals(head, setup, pose.position, pose.rotation);
                for (std::size_t c = 0; c < names.size(); ++c) {
                    const bool tilt = names[c] == "alpha" || names[c] == "beta";
                    // Roundings of unit vectors, and of coordinates of 1200 mm; spots have both, over 2.5 m of path.
                    EXPECT_NEAR(run.find(names[c])->value[i].value(), traced[c].value(), tilt ? 1e-14 : 1e-11);
                }
            }
        }
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

TEST(Simulate, RunsAreNumberedByLineAndBackwardOnesDescend) {
    SimulationOptions options;
    options.repeats = 2;
    options.backward = true;
    options.seconds_per_reading = 1.5;
    const auto run = simulate(machine(), plan(3), Head{}, options);
    ASSERT_EQ(run.size(), 4u * (10 + 10 + 2));
    for (std::size_t i = 0; i < run.size(); ++i) EXPECT_EQ(run.find("time")->value[i], 1.5 * double(i));
    std::size_t i = 0;
    for (const Line& line : {Line::parse("ppp"), Line::parse("nnp"), Line::parse("p00")}) {
        const auto points = plan(3).points(line);
        for (int number = 0; number < 4; ++number)
            for (std::size_t k = 0; k < points.size(); ++k, ++i) {
                const bool backward = number % 2 == 1;
                const std::size_t point = backward ? points.size() - 1 - k : k;
                const auto& station = run.stations()[i];
                EXPECT_EQ(station.line, line);
                EXPECT_EQ(station.run, number);
                EXPECT_EQ(station.point, int(point));
                EXPECT_EQ(station.direction == stepdiag::Direction::backward, backward);
                EXPECT_EQ(station.commanded, points[point].commanded);
            }
    }
    options.backward = false;
    const auto forward = simulate(machine(), plan(3), Head{}, options);
    ASSERT_EQ(forward.size(), 2u * (10 + 10 + 2));
    EXPECT_EQ(forward.stations()[10].run, 1);
    EXPECT_EQ(forward.stations()[10].point, 0);
}

TEST(Simulate, RepeatedAndBackwardRunsReadTheSameWhereNothingTellsThemApart) {
    SimulationOptions options;
    options.misalignment["nnp"] = {{3e-4, -2e-4}, {1e-4, 5e-4}, {0, 0}, 0.1, {}, {2.0, -1.0}, 0.01, 0.02};
    options.misalignment["p00"] = {{1e-4, 0}, {0, 1e-4}};
    const auto single = simulate(machine(), plan(), Head{}, options);
    options.repeats = 3;
    options.backward = true;
    const auto many = simulate(machine(), plan(), Head{}, options);
    EXPECT_EQ(many.find("time"), nullptr);
    for (const auto& channel : single.channels()) {
        std::map<std::pair<std::string, int>, double> expected;
        for (std::size_t i = 0; i < single.size(); ++i)
            expected[{single.stations()[i].line.name(), single.stations()[i].point}] = *channel.value[i];
        for (std::size_t i = 0; i < many.size(); ++i)
            EXPECT_EQ(*many.find(channel.name)->value[i],
                      expected.at({many.stations()[i].line.name(), many.stations()[i].point}));
    }
}

TEST(Simulate, BackwardRunHasTheErrorsOfTheOtherDirection) {
    stepdiag::ParameterTable table;
    table.functions[0] = {{0.0}, {0.0}, {{}}};
    table.negative_functions[0] = {{0.0}, {-0.01}, {{}}};  // 10 um of backlash in X, and Y and Z have none
    const Machine worn(Chain::parse("[w b X Y Z t]"), stepdiag::ErrorMap(table));
    SimulationOptions options;
    options.backward = true;
    const auto run = simulate(worn, plan(1), Head{}, options);
    const auto perfect = simulate(Machine(Chain::parse("[w b X Y Z t]"), {}), plan(1), Head{}, options);
    for (std::size_t i = 0; i < run.size(); ++i) {
        const auto& [number, line, point, direction, commanded] = run.stations()[i];
        const bool negative = (line.sign(stepdiag::Axis::X) < 0) == (direction == stepdiag::Direction::forward);
        const double moved = *run.find("distance")->value[i] - *perfect.find("distance")->value[i];
        // Differences of distances near 1 m, with a few roundings each.
        EXPECT_NEAR(moved, negative ? -0.01 * plan(1).frame(line)(0, 2) : 0.0, 2e-12) << line.name() << point;
    }
}

TEST(Simulate, DriftCountsFromTheFirstReadingOfItsSetUp) {
    SimulationOptions options;
    options.repeats = 2;
    options.backward = true;
    options.seconds_per_reading = 2.0;
    const auto steady = simulate(machine(), plan(1), Head{}, options);
    options.misalignment["nnp"].drift = 1e-4;
    const auto run = simulate(machine(), plan(1), Head{}, options);
    // Lines of four points: rows 16 .. 31 are those of nnp, eight a set-up.
    for (std::size_t i = 0; i < run.size(); ++i) {
        const double drift = i >= 16 && i < 32 ? 1e-4 * 2.0 * double((i - 16) % 8) : 0.0;
        EXPECT_NEAR(*run.find("distance")->value[i] - *steady.find("distance")->value[i], drift, 3e-13);  // of 1 m
        EXPECT_EQ(run.find("alpha")->value[i], steady.find("alpha")->value[i]);
    }
}

TEST(Simulate, GainScalesTiltsAndSpotsAndTheBeamsOffsets) {
    for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam}) {
        Head head, wider;
        head.layout = wider.layout = layout;
        head.psd_distance = wider.psd_distance = 50.0;
        if (layout == HeadLayout::multi_beam) {
            head.beam_offsets = {{0, 1}, {20, 0}, {0, 20}};
            for (const Vector2d& offset : head.beam_offsets) wider.beam_offsets.push_back(1.25 * offset);
        }
        SimulationOptions options;
        options.misalignment["ppp"].reflector = {3e-4, -2e-4};
        const auto run = simulate(machine(), plan(), head, options);
        const auto wide = simulate(machine(), plan(), wider, options);
        options.misalignment["ppp"].gain = 0.25;
        options.misalignment["ppp"].psd_zero = {1.0, -2.0};
        const auto gained = simulate(machine(), plan(), head, options);
        for (const auto& channel : gained.channels())
            for (std::size_t i = 0; i < 31; ++i) {
                const double value = *run.find(channel.name)->value[i];
                const double expected = layout == HeadLayout::multi_beam ? *wide.find(channel.name)->value[i]
                                        : channel.name == "distance"     ? value
                                        : channel.name == "spot_x"       ? 1.25 * value + 1.0
                                        : channel.name == "spot_y"       ? 1.25 * value - 2.0
                                                                         : 1.25 * value;
                EXPECT_EQ(*channel.value[i], expected) << channel.name;
            }
    }
}

TEST(Simulate, RollTurnsTiltsAboutTheBeam) {
    SimulationOptions options;
    options.misalignment["ppp"].laser = {3e-4, -2e-4};
    const auto straight = simulate(machine(), plan(), Head{}, options);
    options.misalignment["ppp"].roll = 0.02;
    const auto rolled = simulate(machine(), plan(), Head{}, options);
    for (std::size_t i = 0; i < 31; ++i) {
        // The normal (beta, -alpha, 1) is turned by -roll in the sensor's axes; roundings of tilts below 1e-3.
        const double alpha = *straight.find("alpha")->value[i], beta = *straight.find("beta")->value[i];
        const double c = std::cos(0.02), s = std::sin(0.02);
        EXPECT_NEAR(*rolled.find("beta")->value[i], c * beta - s * alpha, 1e-15);
        EXPECT_NEAR(*rolled.find("alpha")->value[i], c * alpha + s * beta, 1e-15);
        EXPECT_NEAR(*rolled.find("distance")->value[i], *straight.find("distance")->value[i], 1e-12);
    }
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
    expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].lateral = {0.0, undefined}; }), "ppp");
    expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].drift = undefined; }), "ppp");
    expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].drift = 1.0; }), "seconds_per_reading");
    for (const double roll : {0.1, -0.2, undefined, double(INFINITY)})
        expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].roll = roll; }), "ppp");
    for (const double gain : {0.51, -0.51, undefined, double(INFINITY)})
        expect_refused(with([&](Head&, Options& o) { o.misalignment["ppp"].gain = gain; }), "ppp: gain");
    for (const double seconds : {0.0, -1.0, undefined, double(INFINITY)})
        expect_refused(with([&](Head&, Options& o) { o.seconds_per_reading = seconds; }), "seconds_per_reading");
    for (const int repeats : {0, -1, Options::largest_repeat_count + 1})
        expect_refused(with([&](Head&, Options& o) { o.repeats = repeats; }), "repeats");
    for (const double sigma : {-1.0, undefined, double(INFINITY)}) {
        expect_refused(with([&](Head&, Options& o) { o.noise.distance = sigma; }), "noise");
        expect_refused(with([&](Head&, Options& o) { o.noise.tilt = sigma; }), "noise");
        expect_refused(with([&](Head&, Options& o) { o.noise.spot = sigma; }), "noise");
    }
    for (const double index : {0.99, 0.0, -1.0, undefined, double(INFINITY)})
        expect_refused(with([&](Head&, Options& o) { o.environment = stepdiag::Environment{index}; }),
                       "refractive_index");
}
