// The adjustment of many sets of readings at once, against the adjustment of each alone.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "refuses.hpp"
#include "stepdiag/core/random_lanes.hpp"
#include "stepdiag/evaluation/batch.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace {

using stepdiag::AdjustmentOptions;
using stepdiag::BatchEvaluator;
using stepdiag::BatchOptions;
using stepdiag::EvaluationMethod;
using stepdiag::lane_group;
using stepdiag::Line;
using stepdiag::Measurement;

// What is left after the last step is estimated to be below half of this, in standard uncertainties of each value.
constexpr double converged = 1e-4;

std::vector<Line> parse(std::initializer_list<const char*> names) {
    std::vector<Line> lines;
    for (const char* name : names) lines.push_back(Line::parse(name));
    return lines;
}

// Runs that differ in noise and set-ups; the pattern has neither.
struct Workshop {
    std::vector<Line> lines = parse({"ppp", "npp", "pnp", "nnp"});
    std::vector<Line> scale_lines = parse({"p00", "0p0", "00p"});
    stepdiag::Head head = {};
    std::string chain = "[w X' b Y Z t]";
    double angle = 1e-3;  // standard deviation of set-ups
    int repeats = 1;
    bool backward = false;
    double seconds = 0.0;
    AdjustmentOptions options = {};
    Eigen::Vector3d volume{800.0, 600.0, 500.0}, tool{20.0, -10.0, 50.0};

    stepdiag::Plan plan() const { return {volume, lines, 6, stepdiag::all_axes, scale_lines}; }
    stepdiag::Machine machine() const {
        stepdiag::RandomErrorMap errors;
        errors.intervals = 6;
        errors.seed = 3;
        return {stepdiag::Chain::parse(chain), make_random_error_map(volume, errors), tool};
    }
    stepdiag::SimulationOptions simulation() const {
        stepdiag::SimulationOptions simulation;
        simulation.repeats = repeats;
        simulation.backward = backward;
        if (seconds > 0.0) simulation.seconds_per_reading = seconds;
        return simulation;
    }
    Measurement pattern() const { return simulate(machine(), plan(), head, simulation()); }
    Measurement sample(int number) const {
        std::mt19937 generator(number);
        std::normal_distribution<double> normal(0.0, angle);
        auto simulation = this->simulation();
        simulation.noise = {1e-4, 1e-6, 1e-3, std::uint64_t(number)};
        for (const Line& line : lines) {
            auto& setup = simulation.misalignment[line.name()];
            setup.reflector = {normal(generator), normal(generator)};
            setup.laser = {normal(generator), normal(generator)};
            setup.distance_constant = 1e3 * normal(generator);
        }
        return simulate(machine(), plan(), head, simulation);
    }
    BatchEvaluator evaluator(EvaluationMethod method = EvaluationMethod::adjustment) const {
        return evaluator(pattern(), method);
    }
    BatchEvaluator evaluator(const Measurement& pattern, EvaluationMethod method) const {
        BatchOptions batch;
        batch.method = method;
        batch.adjustment = options;
        return BatchEvaluator(pattern, plan(), machine().chain(), tool, head.calibration(), batch);
    }
    stepdiag::Calibration adjust(const Measurement& run) const {
        AdjustmentOptions of_all = options;
        of_all.outlier_probability = 0.0;
        return stepdiag::adjust(run, plan(), machine().chain(), tool, head.calibration(), of_all).calibration;
    }
};

struct Value {
    double value, standard_uncertainty;
};

std::vector<Value> values(const stepdiag::Calibration& calibration) {
    std::vector<Value> all;
    for (const auto& function : calibration.functions)
        if (function)
            for (std::size_t k = 0; k < function->value.size(); ++k)
                all.push_back({function->value[k], function->standard_uncertainty[k]});
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) all.push_back({squareness->value, squareness->standard_uncertainty});
    return all;
}

std::vector<std::size_t> signals(const Measurement& run) {
    std::vector<std::size_t> list;
    for (std::size_t c = 0; c < run.channels().size(); ++c)
        if (run.channels()[c].name != "time") list.push_back(c);
    return list;
}

Eigen::VectorXd readings(const Measurement& run) {
    const auto channels = signals(run);
    Eigen::VectorXd all(run.size() * channels.size());
    for (std::size_t row = 0; row < run.size(); ++row)
        for (std::size_t c = 0; c < channels.size(); ++c)
            all[row * channels.size() + c] =
                run.channels()[channels[c]].value[row].value_or(std::numeric_limits<double>::quiet_NaN());
    return all;
}

// Readings and values: a row each, a column each sample.
using Lanes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Lanes evaluate(const BatchEvaluator& evaluator, const Lanes& readings) {
    Lanes values(evaluator.entries().size(), readings.cols());
    BatchEvaluator::Worker(evaluator).evaluate(readings.data(), readings.cols(), values.data(), values.cols());
    return values;
}

Lanes in_lanes(const std::vector<Measurement>& runs) {
    Lanes all(readings(runs.front()).size(), lane_group);
    for (std::size_t i = 0; i < lane_group; ++i) all.col(i) = readings(runs[i % runs.size()]);
    return all;
}

void expect_same(const Workshop& shop, int samples = 3) {
    std::vector<Measurement> runs;
    for (int i = 0; i < samples; ++i) runs.push_back(shop.sample(i));
    const BatchEvaluator evaluator = shop.evaluator();
    const Lanes found = evaluate(evaluator, in_lanes(runs));
    for (int i = 0; i < samples; ++i) {
        const auto expected = values(shop.adjust(runs[i]));
        ASSERT_EQ(std::size_t(found.rows()), expected.size());
        for (std::size_t e = 0; e < expected.size(); ++e)
            EXPECT_NEAR(found(e, i), expected[e].value, converged * expected[e].standard_uncertainty)
                << evaluator.entries()[e].parameter << " at " << evaluator.entries()[e].position;
    }
}

Workshop with_psd() {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::psd;
    shop.head.psd_distance = 40.0;
    return shop;
}

Workshop with_beams() {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::multi_beam;
    shop.head.beam_offsets = {{0.0, 0.0}, {20.0, 1.0}, {-2.0, 20.0}, {-9.0, -9.0}};
    return shop;
}

TEST(BatchAdjustment, EverySampleComesOutAsAdjustedAlone) {
    for (const Workshop& shop : {Workshop(), with_psd(), with_beams()}) expect_same(shop);
}

TEST(BatchAdjustment, InAnyChain) {
    for (const char* chain : {"[w b Z X Y t]", "[w Y' Z' X' b t]", "[w Z' X' b Y t]"}) {
        Workshop shop = with_psd();
        shop.chain = chain;
        expect_same(shop, 1);
    }
}

TEST(BatchAdjustment, SetUpsFarFromThePatternsTakeFullSteps) {
    for (const double angle : {5e-3, 2e-2}) {
        Workshop shop = with_psd();
        shop.angle = angle;
        // Known to 2 mrad they would be pulled at; the simulation takes less than 0.1 rad.
        shop.options.setup[static_cast<int>(stepdiag::SetupQuantity::laser)] = stepdiag::free_unknown;
        expect_same(shop);
    }
}

TEST(BatchAdjustment, PriorsCountAsAlone) {
    Workshop shop;
    shop.options.setup[static_cast<int>(stepdiag::SetupQuantity::laser)] = 5e-4;
    shop.options.setup[static_cast<int>(stepdiag::SetupQuantity::reflector)] = 1e-3;
    shop.options.setup_by_line["nnp"][static_cast<int>(stepdiag::SetupQuantity::gain)] = stepdiag::fixed_unknown;
    shop.options.rotations = false;
    shop.options.uncertainty.tilt = 1e-4;
    expect_same(shop);
}

TEST(BatchAdjustment, SmoothnessCountsAsAlone) {
    Workshop shop;
    shop.options.smoothness = {1e-3, 3e-6};
    expect_same(shop);
}

TEST(BatchAdjustment, BackwardRunsAndRepeatsAndDriftCountAsAlone) {
    Workshop shop;
    shop.backward = true;
    shop.repeats = 2;
    shop.seconds = 3.0;
    shop.options.setup[static_cast<int>(stepdiag::SetupQuantity::drift)] = 1e-6;
    expect_same(shop, 2);
}

TEST(BatchAdjustment, WhatReadingsLeaveOpenDoesNotPullAtTheRest) {
    Workshop without_scales;
    without_scales.scale_lines = {};
    expect_same(without_scales);

    Workshop faces;
    faces.lines = parse({"pp0", "np0", "p0p", "n0p", "0pp", "0np"});
    faces.options.setup[static_cast<int>(stepdiag::SetupQuantity::laser)] = stepdiag::free_unknown;
    expect_same(faces);
}

TEST(BatchAdjustment, ReadingsThatThePatternLostAreNotUsed) {
    const Workshop shop = with_psd();
    const auto without = [&](const Measurement& run) {
        auto channels = run.channels();
        channels[0].value[3].reset();
        channels[1].value[5].reset();
        for (auto& channel : channels) channel.value[11].reset();
        return Measurement(run.stations(), channels);
    };
    const Measurement run = shop.sample(1);
    const auto expected = values(shop.adjust(without(run)));
    const Lanes found =
        evaluate(shop.evaluator(without(shop.pattern()), EvaluationMethod::adjustment), in_lanes({run}));
    for (std::size_t e = 0; e < expected.size(); ++e)
        EXPECT_NEAR(found(e, 0), expected[e].value, converged * expected[e].standard_uncertainty);
}

TEST(BatchAdjustment, ALaneKnowsNothingOfItsNeighbours) {
    Workshop shop = with_psd();
    std::vector<Measurement> runs;
    for (int i = 0; i < int(lane_group); ++i) {
        shop.angle = i % 4 == 0 ? 1e-2 : 1e-4;  // some take full steps
        runs.push_back(shop.sample(i));
    }
    const BatchEvaluator evaluator = shop.evaluator();
    const Lanes together = in_lanes(runs), found = evaluate(evaluator, together);

    Lanes turned(together.rows(), 2 * lane_group);
    for (std::size_t i = 0; i < lane_group; ++i) {
        turned.col(i) = together.col(lane_group - 1 - i);
        turned.col(lane_group + i) = together.col(i);
    }
    turned(7, 3) = std::numeric_limits<double>::quiet_NaN();
    turned.col(lane_group + 5) *= 1e6;
    const Lanes again = evaluate(evaluator, turned);
    for (std::size_t i = 0; i < lane_group; ++i) {
        EXPECT_TRUE(found.col(i).allFinite());
        EXPECT_TRUE(i == 3 || again.col(i) == found.col(lane_group - 1 - i)) << i;  // to the bit
        EXPECT_TRUE(i == 5 || again.col(lane_group + i) == found.col(i)) << i;
    }
    EXPECT_TRUE(again.col(3).array().isNaN().all());               // a reading that is no number
    EXPECT_TRUE(again.col(lane_group + 5).array().isNaN().all());  // a kilometre away
}

TEST(BatchAdjustment, GainIsTheChangeOfTheAdjustedValuesWithEachReading) {
    const Workshop shop = with_psd();
    const Measurement run = shop.pattern();
    const Eigen::MatrixXd gain = shop.evaluator().gain();
    const auto at_start = values(shop.adjust(run));
    ASSERT_EQ(gain.rows(), Eigen::Index(at_start.size()));
    ASSERT_EQ(gain.cols(), Eigen::Index(3 * run.size()));
    for (const Eigen::Index reading : {0, 1, 2, 30, 31, 32, 151, int(3 * run.size()) - 3}) {
        const double step = 1e-4;  // mm: its square moves values by 1e-8 of what it does itself
        std::array<std::vector<Value>, 2> sides;
        for (const int side : {0, 1}) {
            auto channels = run.channels();
            auto& value = channels[std::size_t(reading) % 3].value[std::size_t(reading) / 3];
            value = *value + (side == 0 ? -step : step);
            sides[side] = values(shop.adjust(Measurement(run.stations(), channels)));
        }
        for (std::size_t e = 0; e < at_start.size(); ++e) {
            const double expected = (sides[1][e].value - sides[0][e].value) / (2.0 * step);
            // The floor of the adjustment, 2e-11 mm, over the step; a reading weighs up to u/0.1 um.
            EXPECT_NEAR(gain(Eigen::Index(e), reading), expected,
                        1e-6 + 1e-4 * at_start[e].standard_uncertainty / 1e-4);
        }
    }
}

TEST(BatchAdjustment, OneStepIsTheGainTimesTheChange) {
    const Workshop shop = with_beams();
    const BatchEvaluator evaluator = shop.evaluator(EvaluationMethod::one_step);
    const Measurement run = shop.sample(5);
    const Lanes found = evaluate(evaluator, in_lanes({run}));
    const Eigen::VectorXd change = evaluator.gain() * (readings(run) - readings(shop.pattern()));
    const auto start = values(evaluator.of_pattern());
    for (std::size_t e = 0; e < start.size(); ++e)  // sums of a thousand products of 1 mm, rounded to 1e-16
        EXPECT_NEAR(found(e, 0), start[e].value + change[e], 1e-8 * start[e].standard_uncertainty);
}

TEST(BatchAdjustment, OneStepIsOffBySecondOrder) {
    Workshop shop;
    const BatchEvaluator one = shop.evaluator(EvaluationMethod::one_step), all = shop.evaluator();
    std::array<double, 2> worst{};
    for (const int half : {0, 1}) {
        shop.angle = half ? 5e-4 : 1e-3;
        const Lanes lanes = in_lanes({shop.sample(2)});
        const Lanes difference = evaluate(one, lanes) - evaluate(all, lanes);
        const auto u = values(all.of_pattern());
        for (std::size_t e = 0; e < u.size(); ++e)
            if (u[e].standard_uncertainty > 0.0)
                worst[half] = std::max(worst[half], std::abs(difference(e, 0)) / u[e].standard_uncertainty);
    }
    EXPECT_GT(worst[0], 1.0);                      // more than a standard uncertainty at 1 mrad
    EXPECT_NEAR(worst[1] / worst[0], 0.25, 0.05);  // with what is of third order, and of set-up times noise
}

TEST(BatchAdjustment, RefusesWhatTheAdjustmentRefuses) {
    Workshop shop;
    shop.options.smoothness = {-1.0, 0.0};
    expect_refused([&] { shop.evaluator(); }, "smoothness");
}

}  // namespace
