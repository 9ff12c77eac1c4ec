// A calibration is tested by readings that it was made without.
#include "stepdiag/recheck/verification.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "recheck/workshop.hpp"
#include "support/refuses.hpp"

namespace {

using stepdiag::AdjustmentOptions;
using stepdiag::Calibration;
using stepdiag::HeadLayout;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::SetupQuantity;
using stepdiag::Verification;
using Workshop = stepdiag::test::RecheckWorkshop;

Verification verified(const Workshop& workshop, const Calibration& calibration, const Measurement& run,
                      const AdjustmentOptions& options = {}) {
    return verify(calibration, run, workshop.test_plan(), workshop.machine().chain(), workshop.tool,
                  workshop.head.calibration(), options);
}

TEST(Verify, ReadingsOfTheSameMachineAgree) {
    for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam}) {
        Workshop workshop;
        workshop.head.layout = layout;
        if (layout == HeadLayout::multi_beam) workshop.head.beam_offsets = {{15.0, 0.0}, {-8.0, 12.0}, {-8.0, -12.0}};
        workshop.head.psd_distance = 60.0;
        const Verification found = verified(workshop, workshop.calibration(1), workshop.test_run(2));
        EXPECT_GT(found.probability, 1e-3);
        EXPECT_EQ(found.lines.size(), 2u);
        for (const auto& line : found.lines) {
            EXPECT_LT(std::abs(line.normalised()), 2.0) << line.line;
            EXPECT_GT(line.standard_uncertainty, 0.05e-3);
            EXPECT_LT(line.standard_uncertainty, 0.1);
        }
    }
}

// The mean of chi-square is its degrees of freedom, and 95.4 % of E_n are below 1: both within 3.3 standard deviations
// of 40 machines with two lines each.
TEST(Verify, DeviationsAreAsLargeAsTheirUncertaintySays) {
    Workshop workshop;
    double chi_square = 0.0, freedom = 0.0;
    int within = 0, lines = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        workshop.machine_seed = seed;
        const Verification found =
            verified(workshop, workshop.calibration(seed), workshop.test_run(1000 + seed), workshop.aligned_priors());
        chi_square += found.chi_square;
        freedom += found.degrees_of_freedom;
        for (const auto& line : found.lines) {
            ++lines;
            within += std::abs(line.normalised()) < 1.0;
        }
    }
    EXPECT_NEAR(chi_square, freedom, 3.3 * std::sqrt(2.0 * freedom));
    EXPECT_NEAR(within, 0.954 * lines, 3.3 * std::sqrt(0.954 * 0.046 * lines));
}

TEST(Verify, ChangedSquarenessIsSeenOnItsLines) {
    Workshop workshop;
    Calibration calibration = workshop.calibration(1);
    calibration.squarenesses[0]->value += 20e-6;  // along a diagonal of the XY rectangle some 5 um
    const Verification found = verified(workshop, calibration, workshop.test_run(2));
    EXPECT_LT(found.probability, 1e-6);
    EXPECT_GT(std::abs(found.lines[0].normalised()), 2.0);
    EXPECT_LT(found.lines[0].deviation * found.lines[1].deviation, 0.0);  // one longer, the other shorter
}

TEST(Verify, OneWrongReadingIsNamedAndTheRestAgrees) {
    const Workshop workshop;
    const Calibration calibration = workshop.calibration(1);
    for (const double wrong : {5e-3, -1.0}) {
        const Verification found = verified(workshop, calibration, workshop.test_run_with(5, wrong));
        EXPECT_GT(found.probability, 1e-3);
        ASSERT_EQ(found.left_out.size(), 1u);
        ASSERT_EQ(found.left_out[0].members.size(), 1u);
        const stepdiag::Fault& fault = found.left_out[0].members[0];
        EXPECT_EQ(fault.row, 5u);
        EXPECT_EQ(fault.channel, "distance");
        EXPECT_NEAR(fault.size, wrong, 5.0 * fault.standard_uncertainty);
        EXPECT_LT(fault.standard_uncertainty, 2e-3);
        for (const auto& reading : found.readings) EXPECT_FALSE(reading.row == 5 && reading.channel == "distance");
    }
}

TEST(Verify, WhatCannotBePredictedIsRefusedByName) {
    const Workshop workshop;
    const Calibration sound = workshop.calibration(1);
    const Measurement run = workshop.test_run(2);
    Calibration changed = sound;
    changed.covariance.resize(0, 0);
    expect_refused([&] { verified(workshop, changed, run); }, "covariance");
    changed = sound;
    changed.functions[4].reset();
    changed.covariance.resize(0, 0);
    expect_refused([&] { verified(workshop, changed, run); }, "does not determine EBX");
    changed = sound;
    changed.tool.x() += 1.0;
    expect_refused([&] { verified(workshop, changed, run); }, "tool: the calibration has 21.0 -10.0 50.0 mm");
    changed = sound;
    changed.temperature_reference = 20.0;
    expect_refused([&] { verified(workshop, changed, run); }, "referred to 20");
}

}  // namespace
