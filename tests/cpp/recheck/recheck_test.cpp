// Whether the machine has changed since its calibration, and by what.
#include "stepdiag/recheck/recheck.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "recheck/workshop.hpp"
#include "support/refuses.hpp"

namespace {

using stepdiag::AdjustmentOptions;
using stepdiag::Calibration;
using stepdiag::ChangeKind;
using stepdiag::ChangeTerm;
using stepdiag::Line;
using stepdiag::Recheck;
using stepdiag::SetupQuantity;
using stepdiag::test::RecheckWorkshop;

const ChangeTerm& term(const Recheck& recheck, const std::string& parameter) {
    for (const ChangeTerm& one : recheck.terms)
        if (one.parameter == parameter) return one;
    throw std::out_of_range(parameter);
}

Recheck rechecked(const RecheckWorkshop& workshop, const Calibration& baseline, std::uint64_t seed) {
    return recheck(baseline, workshop.test_run(seed), workshop.test_plan(), workshop.machine().chain(), workshop.tool,
                   workshop.head.calibration(), workshop.aligned_priors());
}

TEST(Recheck, UnchangedMachineIsNotSaidToHaveChanged) {
    RecheckWorkshop workshop;
    double chi_square = 0.0, freedom = 0.0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        workshop.machine_seed = seed;
        const Recheck found = rechecked(workshop, workshop.calibration(seed), 1000 + seed);
        EXPECT_GT(found.probability, 1e-5);
        chi_square += found.chi_square;
        freedom += found.degrees_of_freedom;
    }
    EXPECT_NEAR(chi_square, freedom, 3.3 * std::sqrt(2.0 * freedom));  // the mean of a chi-square distribution
}

TEST(Recheck, ChangedSquarenessIsFoundAndAttributed) {
    RecheckWorkshop workshop;
    workshop.test_lines = stepdiag::test::diagonals;
    const Calibration baseline = workshop.calibration(1);
    workshop.hit = 40e-6;  // of C0Y
    const Recheck found = rechecked(workshop, baseline, 2);
    EXPECT_LT(found.probability, 1e-6);
    EXPECT_GT(found.fit_probability, 1e-3);
    const ChangeTerm& squareness = term(found, "C0Y");
    EXPECT_EQ(squareness.kind, ChangeKind::squareness);
    EXPECT_GT(squareness.determined, 0.9);
    EXPECT_NEAR(squareness.value, 40e-6, 4.0 * squareness.standard_uncertainty);
    EXPECT_LT(squareness.standard_uncertainty, 8e-6);
    const int c0y = 0;
    EXPECT_NEAR(found.updated.squarenesses[c0y]->value, baseline.squarenesses[c0y]->value + 40e-6,
                4.0 * found.updated.squarenesses[c0y]->standard_uncertainty);
}

TEST(Recheck, OneDiagonalTellsScalesAndSquarenessesTogetherOnly) {
    RecheckWorkshop workshop;
    workshop.test_lines = {Line::parse("ppp")};
    const Calibration baseline = workshop.calibration(1);
    workshop.hit = 100e-6;
    const Recheck found = rechecked(workshop, baseline, 2);
    EXPECT_LT(found.probability, 1e-3);
    for (const char* parameter : {"EXX", "EYY", "EZZ", "C0Y", "B0Z", "A0Z"})
        EXPECT_LT(term(found, parameter).determined, 0.9) << parameter;
    EXPECT_FALSE(found.combinations.empty());
}

// The mean square deviation of the updated values from the truth is that of their uncertainties, and below that of the
// baseline where the machine has changed.
TEST(Recheck, UpdatedCalibrationIsNearerToTheMachine) {
    RecheckWorkshop workshop;
    workshop.test_lines = stepdiag::test::diagonals;
    double before = 0.0, after = 0.0, normalised = 0.0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        workshop.machine_seed = seed;
        workshop.hit = 0.0;
        const Calibration baseline = workshop.calibration(seed);
        workshop.hit = 30e-6;
        const Recheck found = rechecked(workshop, baseline, 500 + seed);
        const double truth = workshop.machine().errors().squareness(stepdiag::Squareness::C0Y);
        before += std::pow(baseline.squarenesses[0]->value - truth, 2);
        after += std::pow(found.updated.squarenesses[0]->value - truth, 2);
        normalised += std::pow(
            (found.updated.squarenesses[0]->value - truth) / found.updated.squarenesses[0]->standard_uncertainty, 2);
    }
    EXPECT_LT(after, 0.2 * before);
    EXPECT_LT(normalised, 20.0 + 3.3 * std::sqrt(40.0));
}

// Of all 21 terms those that are free take their degrees of freedom with them: the square sum is chi-square distributed
// where nothing has changed, and where the machine has.
TEST(Recheck, FitOfSoundReadingsIsChiSquareDistributedWhetherOrNotTheMachineHasChanged) {
    for (const double hit : {0.0, 40e-6}) {
        RecheckWorkshop workshop;
        double chi_square = 0.0, freedom = 0.0;
        for (std::uint64_t seed = 1; seed <= 40; ++seed) {
            workshop.machine_seed = seed;
            workshop.hit = 0.0;
            const Calibration baseline = workshop.calibration(seed);
            workshop.hit = hit;
            const Recheck found = rechecked(workshop, baseline, 1000 + seed);
            chi_square += found.fit_chi_square;
            freedom += found.fit_degrees_of_freedom;
        }
        EXPECT_NEAR(chi_square, freedom, 3.3 * std::sqrt(2.0 * freedom));
    }
}

TEST(Recheck, NewScrewErrorIsUnexplainedAndItsMisfitsAreNamed) {
    RecheckWorkshop workshop;
    workshop.test_lines = stepdiag::test::diagonals;
    const Calibration baseline = workshop.calibration(1);
    workshop.screw = 20e-3;
    const Recheck found = rechecked(workshop, baseline, 2);
    EXPECT_LT(found.fit_probability, 1e-12);
    EXPECT_TRUE(found.left_out.empty());
    ASSERT_EQ(found.misfits.size(), 5u);
    double before = std::abs(found.misfits[0].normalised());
    EXPECT_GT(before, 10.0);
    for (const auto& misfit : found.misfits) {
        EXPECT_LE(std::abs(misfit.normalised()), before);
        before = std::abs(misfit.normalised());
    }
}

// On one diagonal, from which no adjustment could tell.
TEST(Recheck, OneWrongReadingIsNamedAndTheMachineJudgedWithoutIt) {
    RecheckWorkshop workshop;
    workshop.test_lines = {Line::parse("ppp")};
    const Calibration baseline = workshop.calibration(1);
    for (const double wrong : {20e-3, 1.0}) {
        const Recheck found = recheck(baseline, workshop.test_run_with(4, wrong), workshop.test_plan(),
                                      workshop.machine().chain(), workshop.tool, workshop.head.calibration());
        ASSERT_EQ(found.left_out.size(), 1u);
        EXPECT_EQ(found.left_out[0].members[0].row, 4u);
        const stepdiag::Fault& fault = found.left_out[0].members[0];
        EXPECT_NEAR(fault.size, wrong, 5.0 * fault.standard_uncertainty);
        EXPECT_GT(found.probability, 1e-3);
        EXPECT_GT(found.fit_probability, 1e-3);
    }
}

TEST(Recheck, PriorsThatMakeNoSenseAreRefused) {
    const RecheckWorkshop workshop;
    const Calibration baseline = workshop.calibration(1);
    const auto with = [&](const stepdiag::ChangePriors& priors) {
        recheck(baseline, workshop.test_run(2), workshop.test_plan(), workshop.machine().chain(), workshop.tool,
                workshop.head.calibration(), {}, priors);
    };
    expect_refused([&] { with({-1e-6, 0.0, 0.0, 0.0}); }, "at least 0");
    expect_refused([&] { with({0.0, 0.0, 0.0, 0.0}); }, "one kind of change");
}

}  // namespace
