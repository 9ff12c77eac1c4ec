// Batches of linear evaluations beside evaluate_enhanced and evaluate_conventional, set by set.
#include "stepdiag/batch/batch_evaluator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/instruction_set.hpp"
#include "support/batch_runs.hpp"
#include "support/refuses.hpp"

namespace stepdiag {
namespace {

// Of values and lanes, sets[lane] by sets[lane].
std::vector<double> evaluate_batch(const BatchEvaluator& batch, const std::vector<Measurement>& sets) {
    std::vector<double> values(batch.entries().size() * sets.size());
    BatchEvaluator::Worker(batch).evaluate(in_lanes(sets).data(), sets.size(), values.data(), sets.size());
    return values;
}

// What rounding leaves open of each value: a reading reaches it by its gain, rounded to half an epsilon of itself, or
// of the 1 of a direction, four times by either of two evaluations: where it is reduced, where it is weighed, in two
// sums.
std::vector<double> roundings(const BatchEvaluator& batch, const Measurement& pattern) {
    Eigen::VectorXd size(Eigen::Index(pattern.size() * signal_count(pattern)));
    Eigen::Index r = 0;
    for (std::size_t row = 0; row < pattern.size(); ++row)
        for (const auto& channel : pattern.channels())
            size[r++] = std::max(1.0, std::abs(channel.value[row].value_or(0.0)));
    const Eigen::VectorXd sum = 4.0 * std::numeric_limits<double>::epsilon() * batch.gain().cwiseAbs() * size;
    return {sum.begin(), sum.end()};
}

// How far a set that is not the pattern may be off its own evaluation: there the weights are those of the set's own
// tilts, which its noise of 1 to 2 urad turns by some 1e-5 to 1e-4 of the effect that tilts have on lengths, and so
// moves what redundancy decides by about that share of its uncertainty.
std::vector<double> tolerances(const BatchEvaluator& batch, const Measurement& pattern) {
    std::vector<double> list = roundings(batch, pattern);
    std::size_t e = 0;
    const auto add = [&](double u) { list[e++] += 5e-4 * u; };
    for (const auto& function : batch.of_pattern().functions)
        if (function) std::for_each(function->standard_uncertainty.begin(), function->standard_uncertainty.end(), add);
    for (const auto& squareness : batch.of_pattern().squarenesses)
        if (squareness) add(squareness->standard_uncertainty);
    return list;
}

class EveryRun : public testing::TestWithParam<std::tuple<std::size_t, Method>> {
protected:
    const TestRun run = runs()[std::get<0>(GetParam())];
    const Method method = std::get<1>(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Batch, EveryRun,
                         testing::Combine(testing::Range<std::size_t>(0, runs().size()),
                                          testing::Values(Method::enhanced, Method::conventional)),
                         [](const auto& each) {
                             return runs()[std::get<0>(each.param)].name +
                                    (std::get<1>(each.param) == Method::enhanced ? "_enhanced" : "_conventional");
                         });

TEST_P(EveryRun, IsEvaluatedAsOneByOne) {
    std::vector<Measurement> sets;
    for (std::uint64_t lane = 0; lane < 32; ++lane) sets.push_back(run.measure(lane));
    const BatchEvaluator batch = run.batch(sets[0], method);
    const std::vector<double> values = evaluate_batch(batch, sets);
    const std::vector<double> rounding = roundings(batch, sets[0]), noisy = tolerances(batch, sets[0]);
    for (std::size_t lane = 0; lane < sets.size(); ++lane) {
        const std::vector<double> expected = values_of(run.evaluate(sets[lane], method));
        ASSERT_EQ(expected.size(), batch.entries().size());
        const std::vector<double>& tolerance = lane == 0 ? rounding : noisy;
        for (std::size_t e = 0; e < expected.size(); ++e)
            ASSERT_NEAR(values[e * sets.size() + lane], expected[e], tolerance[e])
                << lane << " " << batch.entries()[e].parameter << " " << batch.entries()[e].position;
    }
}

TEST_P(EveryRun, GainIsTheDerivativeByEveryReading) {
    // Sets that are off the pattern by so little that nothing of second order is left, and enough for six digits.
    const Measurement pattern = run.measure(0);
    std::vector<Measurement> sets;
    for (std::uint64_t lane = 0; lane < 16; ++lane) {
        const Measurement noisy = run.measure(lane + 1);
        auto channels = pattern.channels();
        for (std::size_t c = 0; c < channels.size(); ++c)
            for (std::size_t row = 0; row < pattern.size(); ++row)
                *channels[c].value[row] += 1e-3 * (*noisy.channels()[c].value[row] - *channels[c].value[row]);
        sets.emplace_back(pattern.stations(), channels);
    }
    const BatchEvaluator batch = run.batch(pattern, method);
    const std::vector<double> values = evaluate_batch(batch, sets);
    const Eigen::MatrixXd gain = batch.gain();
    ASSERT_EQ(gain.rows(), Eigen::Index(batch.entries().size()));
    ASSERT_EQ(gain.cols(), Eigen::Index(pattern.size() * signal_count(pattern)));
    const std::vector<double> at = values_of(batch.of_pattern()), rounding = roundings(batch, pattern);
    for (std::size_t lane = 0; lane < sets.size(); ++lane) {
        Eigen::VectorXd change(gain.cols());
        for (std::size_t row = 0, r = 0; row < pattern.size(); ++row)
            for (std::size_t c = 0; c < signal_count(pattern); ++c)
                change[Eigen::Index(r++)] = *sets[lane].channels()[c].value[row] - *pattern.channels()[c].value[row];
        const Eigen::VectorXd expected = gain * change;
        for (std::size_t e = 0; e < at.size(); ++e)
            ASSERT_NEAR(values[e * sets.size() + lane] - at[e], expected[Eigen::Index(e)], rounding[e])
                << batch.entries()[e].parameter << " " << batch.entries()[e].position;
    }
}

TEST(Batch, EntriesAreThoseOfTheTables) {
    const TestRun run = runs()[0];
    const BatchEvaluator batch = run.batch(run.measure(0), Method::enhanced);
    ASSERT_EQ(batch.entries().size(), 18u * 7 + 3);
    EXPECT_EQ(batch.entries()[0].parameter, "EXX");
    EXPECT_EQ(batch.entries()[6].position, 800.0);
    EXPECT_EQ(batch.entries()[7].position, 0.0);
    EXPECT_EQ(batch.entries().back().parameter, "A0Z");
    EXPECT_TRUE(std::isnan(batch.entries().back().position));
    EXPECT_GT(batch.of_pattern().functions[0]->standard_uncertainty[6], 0.0);
}

TEST(Batch, ALaneDependsOnItsOwnReadingsAlone) {
    for (const std::size_t which : {0, 1, 2}) {
        const TestRun run = runs()[which];
        std::vector<Measurement> sets;
        for (std::uint64_t lane = 0; lane < 48; ++lane) sets.push_back(run.measure(lane + 1));
        const BatchEvaluator batch = run.batch(sets[0], Method::enhanced);
        const std::vector<double> all = evaluate_batch(batch, sets);
        std::vector<Measurement> backwards(sets.rbegin() + 32, sets.rend());
        const std::vector<double> some = evaluate_batch(batch, backwards);
        for (std::size_t e = 0; e < batch.entries().size(); ++e)
            for (std::size_t lane = 0; lane < 16; ++lane) EXPECT_EQ(some[16 * e + 15 - lane], all[48 * e + lane]);
    }
}

TEST(Batch, ALaneWithALostReadingOrWithoutAMirrorGivesNone) {
    for (const std::size_t which : {0, 1, 2}) {
        const TestRun run = runs()[which];
        const std::vector<Measurement> sets(16, run.measure(3));
        const BatchEvaluator batch = run.batch(sets[0], Method::enhanced);
        std::vector<double> readings = in_lanes(sets), values(batch.entries().size() * 20, 7.0);
        const std::size_t channels = signal_count(sets[0]);
        readings[(5 * channels + 1) * 16 + 3] = std::numeric_limits<double>::quiet_NaN();
        readings[(70 * channels + 0) * 16 + 9] = std::numeric_limits<double>::infinity();
        if (which == 0) readings[(8 * channels + 2) * 16 + 15] = 1.5;  // a tilt of 56 degrees
        if (which == 1) readings[(8 * channels + 0) * 16 + 15] = -300.0;
        BatchEvaluator::Worker worker(batch);
        worker.evaluate(readings.data(), 16, values.data(), 20);
        const std::vector<double> expected = evaluate_batch(batch, sets);
        for (std::size_t e = 0; e < batch.entries().size(); ++e)
            for (std::size_t lane = 0; lane < 20; ++lane) {
                const bool is_lost = lane == 3 || lane == 9 || (lane == 15 && which < 2);
                if (is_lost) EXPECT_TRUE(std::isnan(values[20 * e + lane]));
                else EXPECT_EQ(values[20 * e + lane], lane < 16 ? expected[16 * e + lane] : 7.0);
            }
        worker.evaluate(in_lanes(sets).data(), 16, values.data(), 20);  // nothing of it is left
        EXPECT_EQ(values[20 * 30 + 3], expected[16 * 30 + 3]);
    }
}

TEST(Batch, ReadingsThatThePatternLacksDoNotCount) {
    for (const std::size_t which : {0, 1, 2, 3}) {
        const TestRun run = runs()[which];
        const auto lose = [](const Measurement& measurement) {
            auto channels = measurement.channels();
            channels.back().value[4].reset();
            channels.front().value[30].reset();
            channels.back().value[measurement.size() - 1].reset();  // of a scale line, which needs distances only
            return Measurement(measurement.stations(), channels);
        };
        for (const Method method : {Method::enhanced, Method::conventional}) {
            std::vector<Measurement> sets;
            for (std::uint64_t lane = 0; lane < 32; ++lane) sets.push_back(lose(run.measure(lane)));
            const BatchEvaluator batch = run.batch(sets[0], method);
            const std::vector<double> values = evaluate_batch(batch, sets);
            const std::vector<double> rounding = roundings(batch, sets[0]), noisy = tolerances(batch, sets[0]);
            for (const std::size_t lane : {0, 5, 21}) {
                const std::vector<double> expected = values_of(run.evaluate(sets[lane], method));
                const std::vector<double>& tolerance = lane == 0 ? rounding : noisy;
                ASSERT_EQ(expected.size(), batch.entries().size());
                for (std::size_t e = 0; e < expected.size(); ++e)
                    ASSERT_NEAR(values[32 * e + lane], expected[e], tolerance[e]);
            }
        }
    }
}

TEST(Batch, SteepTiltsAreReducedAsOneByOne) {
    // Where Newton's method needs its steps: tilts up to a tenth, a spot of a beam beside the axis.
    TestRun run = runs()[1];
    run.heads.head = spot_head({8.0, -5.0});
    const Measurement usual = run.measure(0);
    std::vector<Measurement> sets;
    for (int lane = 0; lane < 16; ++lane) {
        auto channels = usual.channels();
        for (std::size_t row = 0; row < usual.size(); ++row) {
            const Reading reading{*channels[0].value[row], 0.006 * lane, -0.004 * lane};
            const Eigen::Vector2d spot = spot_position(reading, 250.0, {8.0, -5.0});
            channels[1].value[row] = spot.x(), channels[2].value[row] = spot.y();
        }
        sets.emplace_back(usual.stations(), channels);
    }
    for (std::size_t lane = 0; lane < 16; ++lane) {
        const BatchEvaluator batch = run.batch(sets[lane], Method::enhanced);
        const std::vector<double> values = evaluate_batch(batch, sets);
        const std::vector<double> expected = values_of(batch.of_pattern());
        for (std::size_t e = 0; e < expected.size(); ++e)  // rounding of the tilts, by lever arms of 1 m
            ASSERT_NEAR(values[16 * e + lane], expected[e], 2e-11) << lane;
    }
}

TEST(Batch, RefusesWhatTheEvaluationRefuses) {
    const TestRun run = runs()[0];
    expect_refused([&] { runs()[5].batch(run.measure(0), Method::enhanced); }, "row");
    expect_refused(
        [&] {
            TestRun{"faces", Plan(volume, lines({"pp0"}), 2), {}}.batch(
                TestRun{"faces", Plan(volume, lines({"pp0"}), 2), {}}.measure(0), Method::conventional);
        },
        "diagonals");
}

class EveryInstructionSet : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override { choose_instruction_set(GetParam()); }
    void TearDown() override { choose_instruction_set(best_); }
    const std::string best_ = instruction_set();
};
INSTANTIATE_TEST_SUITE_P(Batch, EveryInstructionSet, testing::ValuesIn(instruction_sets()),
                         [](const auto& each) { return each.param; });

TEST_P(EveryInstructionSet, GivesTheSameValues) {
    for (const std::size_t which : {0, 1, 3}) {
        const TestRun run = runs()[which];
        const std::vector<Measurement> sets(16, run.measure(3));
        const BatchEvaluator batch = run.batch(sets[0], Method::enhanced);
        const std::vector<double> values = evaluate_batch(batch, sets);
        const std::vector<double> expected = values_of(batch.of_pattern()), rounding = roundings(batch, sets[0]);
        for (std::size_t e = 0; e < expected.size(); ++e)
            for (std::size_t lane = 0; lane < 16; ++lane) ASSERT_NEAR(values[16 * e + lane], expected[e], rounding[e]);
    }
}

}  // namespace
}  // namespace stepdiag
