// The adjustment of many sets of readings at once, against the adjustment of each alone.
#include <gtest/gtest.h>

#include <cmath>

#include "stepdiag/core/instruction_set.hpp"
#include "support/batch_workshop.hpp"
#include "support/refuses.hpp"

namespace {

using namespace batch_tests;

// What is left after the last step is estimated to be below half of this, in standard uncertainties of each value.
constexpr double converged = 1e-4;

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

TEST(BatchAdjustment, SetUpsOfMilliradiansComeOutAsAlone) {
    Workshop shop;
    shop.angle = 3e-3;
    shop.head.aperture = 1000.0, shop.head.mirror = {1000.0, 1000.0};  // no reading is lost
    expect_same(shop, int(lane_group));
}

TEST(BatchAdjustment, BeamsWhoseLasersStandAsTheirPriorsSayComeOutAsAlone) {
    Workshop shop = with_beams();
    shop.head.beam_offsets = {{50.0, 0.0}, {-25.0, 43.3}, {-25.0, -43.3}};
    shop.head.aperture = 1000.0, shop.head.mirror = {1000.0, 1000.0};
    shop.angle = 2e-3;
    expect_same(shop, int(lane_group));
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
    faces.lines = stepdiag::test::lines({"pp0", "np0", "p0p", "n0p", "0pp", "0np"});
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

TEST(BatchAdjustment, AllInstructionSetsAgree) {
    const std::string chosen = stepdiag::instruction_set();
    const Workshop shop = with_psd();
    const Lanes lanes = in_lanes({shop.sample(0), shop.sample(1)});
    const BatchEvaluator evaluator = shop.evaluator();
    const Lanes expected = evaluate(evaluator, lanes);
    const auto u = values(evaluator.of_pattern());
    for (const std::string& target : stepdiag::instruction_sets()) {
        stepdiag::choose_instruction_set(target);
        const Lanes found = evaluate(shop.evaluator(), lanes);
        for (std::size_t e = 0; e < u.size(); ++e)  // the number of steps may differ
            EXPECT_NEAR(found(e, 1), expected(e, 1), converged * u[e].standard_uncertainty) << target;
    }
    stepdiag::choose_instruction_set(chosen);
}

TEST(BatchAdjustment, RefusesWhatTheAdjustmentRefuses) {
    Workshop shop;
    shop.options.smoothness = {-1.0, 0.0};
    expect_refused([&] { shop.evaluator(); }, "smoothness");
}

}  // namespace
