// A calibration is tested by readings that it was made without.
#include "stepdiag/recheck/verification.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stepdiag/simulation/simulate.hpp"
#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector3d;
using stepdiag::AdjustmentOptions;
using stepdiag::Calibration;
using stepdiag::HeadLayout;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::SetupQuantity;
using stepdiag::Verification;

// A machine, the run that calibrates it, and the run that tests the calibration: another tool path, other set-ups.
struct Workshop {
    int steps = 6;
    stepdiag::Head head = {};
    Vector3d volume = stepdiag::test::volume, tool{20.0, -10.0, 50.0};
    std::uint64_t machine_seed = 3;
    stepdiag::RandomErrorMap shape = {};

    stepdiag::Machine machine() const {
        stepdiag::RandomErrorMap errors = shape;
        errors.intervals = steps;
        errors.seed = machine_seed;
        return {stepdiag::test::chain, make_random_error_map(volume, errors), tool};
    }
    stepdiag::Plan plan() const {
        return {volume, stepdiag::test::diagonals, steps, stepdiag::all_axes, stepdiag::test::scale_lines};
    }
    // Two of the diagonals, in larger steps.
    stepdiag::Plan test_plan() const {
        return {volume, {Line::parse("ppp"), Line::parse("pnp")}, steps / 2, stepdiag::all_axes, {}};
    }
    static stepdiag::SimulationOptions simulation(const stepdiag::Plan& plan, std::uint64_t seed) {
        stepdiag::SimulationOptions options;
        double angle = 300e-6;
        for (const Line& line : plan.lines()) {
            options.misalignment[line.name()].reflector = {angle, -0.5 * angle};
            options.misalignment[line.name()].laser = {1e-3 - angle, angle};
            options.misalignment[line.name()].distance_constant = 7.0;
            angle += 200e-6;
        }
        options.noise.distance = 0.1e-3;
        options.noise.tilt = 1e-6;
        options.noise.spot = 1e-3;
        options.noise.seed = seed;
        return options;
    }
    Measurement run(std::uint64_t seed) const { return simulate(machine(), plan(), head, simulation(plan(), seed)); }
    Measurement test_run(std::uint64_t seed) const {
        return simulate(machine(), test_plan(), head, simulation(test_plan(), seed));
    }
    Calibration calibration(std::uint64_t seed) const {
        AdjustmentOptions options;
        options.full_covariance = true;
        return adjust(run(seed), plan(), machine().chain(), tool, head.calibration(), options).calibration;
    }
    Verification verify(const Calibration& calibration, const Measurement& run,
                        const AdjustmentOptions& options = {}) const {
        return stepdiag::verify(calibration, run, test_plan(), machine().chain(), tool, head.calibration(), options);
    }
};

TEST(Verify, ReadingsOfTheSameMachineAgree) {
    for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam}) {
        Workshop workshop;
        workshop.head.layout = layout;
        if (layout == HeadLayout::multi_beam) workshop.head.beam_offsets = {{15.0, 0.0}, {-8.0, 12.0}, {-8.0, -12.0}};
        workshop.head.psd_distance = 60.0;
        const Verification found = workshop.verify(workshop.calibration(1), workshop.test_run(2));
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
    AdjustmentOptions options;
    // The simulated set-ups have none of these, so that a prior would count as a reading without error.
    for (const auto quantity : {SetupQuantity::lateral, SetupQuantity::roll, SetupQuantity::gain})
        options.setup[std::size_t(quantity)] = stepdiag::fixed_unknown;
    double chi_square = 0.0, freedom = 0.0;
    int within = 0, lines = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        workshop.machine_seed = seed;
        const Verification found = workshop.verify(workshop.calibration(seed), workshop.test_run(1000 + seed), options);
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
    const Verification found = workshop.verify(calibration, workshop.test_run(2));
    EXPECT_LT(found.probability, 1e-6);
    EXPECT_GT(std::abs(found.lines[0].normalised()), 2.0);
    EXPECT_LT(found.lines[0].deviation * found.lines[1].deviation, 0.0);  // one longer, the other shorter
}

TEST(Verify, OneWrongReadingIsTheWorst) {
    Workshop workshop;
    const Measurement run = workshop.test_run(2);
    auto channels = run.channels();
    channels[0].value[5] = *channels[0].value[5] + 5e-3;
    const Verification found =
        workshop.verify(workshop.calibration(1), Measurement(run.stations(), std::move(channels)));
    EXPECT_EQ(found.readings[found.worst].row, 5u);
    EXPECT_EQ(found.readings[found.worst].channel, "distance");
    EXPECT_GT(found.readings[found.worst].deviation, 2e-3);  // the set-ups take the rest
}

TEST(Verify, WhatCannotBePredictedIsRefusedByName) {
    const Workshop workshop;
    const Calibration sound = workshop.calibration(1);
    const Measurement run = workshop.test_run(2);
    Calibration changed = sound;
    changed.covariance.resize(0, 0);
    expect_refused([&] { workshop.verify(changed, run); }, "covariance");
    changed = sound;
    changed.functions[4].reset();
    changed.covariance.resize(0, 0);
    expect_refused([&] { workshop.verify(changed, run); }, "does not determine EBX");
    changed = sound;
    changed.tool.x() += 1.0;
    expect_refused([&] { workshop.verify(changed, run); }, "tool: the calibration has 21.0 -10.0 50.0 mm");
    changed = sound;
    changed.temperature_reference = 20.0;
    expect_refused([&] { workshop.verify(changed, run); }, "referred to 20");
}

}  // namespace
