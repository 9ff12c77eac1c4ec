// What a reading does to the adjusted values, and the one step that takes them for linear in it.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>

#include "batch/prepared_adjustment.hpp"
#include "support/batch_workshop.hpp"

namespace {

using namespace batch_tests;

// Of the weighted derivatives J at the pattern's solution, columns scaled to 1: the root of that of N = J^T J + P.
double condition(const Workshop& shop) {
    const stepdiag::PreparedAdjustment prepared(shop.pattern(), shop.plan(), shop.machine().chain(), shop.tool,
                                                shop.head.calibration(), shop.options, {});
    const Eigen::Index unknowns = prepared.start.size();
    Eigen::MatrixXd n(unknowns, unknowns);
    using stepdiag::BorderedFactor;
    for (Eigen::Index j = 0; j < unknowns; j += BorderedFactor::sides) {
        const Eigen::Index count = std::min<Eigen::Index>(BorderedFactor::sides, unknowns - j);
        BorderedFactor::Sides units = BorderedFactor::Sides::Zero(unknowns, BorderedFactor::sides);
        units.block(j, 0, count, count).setIdentity();
        n.middleCols(j, count) = prepared.solver.equations().products(units).leftCols(count);
    }
    const Eigen::VectorXd scale = n.diagonal().cwiseSqrt().cwiseInverse();
    n = scale.asDiagonal() * n * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(n, Eigen::EigenvaluesOnly);
    return std::sqrt(solver.eigenvalues().maxCoeff() / solver.eigenvalues().minCoeff());
}

TEST(BatchGain, GainIsTheChangeOfTheAdjustedValuesWithEachReading) {
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

TEST(BatchGain, OneStepIsTheGainTimesTheChange) {
    const Workshop shop = with_beams();
    const BatchEvaluator evaluator = shop.evaluator(EvaluationMethod::one_step);
    const Measurement run = shop.sample(5);
    const Lanes found = evaluate(evaluator, in_lanes({run}));
    const Eigen::VectorXd change = readings(run) - readings(shop.pattern());
    const Eigen::VectorXd expected = evaluator.gain() * change;
    const auto start = values(evaluator.of_pattern());
    // A value changes by at most the norm of all changes in standard uncertainties, times its own (Cauchy and Schwarz).
    // Either side multiplies by J^T and solves with L and L^T, N = L L^T: six steps of sums that are no longer than the
    // readings are many. Each product rounds by half an epsilon of that norm, sums add it up as a random walk, and a
    // solution magnifies it by the condition of J, not by its square: both sides have the same L.
    const double norm = change.norm() / shop.options.uncertainty.distance;
    const double rounding =
        std::numeric_limits<double>::epsilon() / 2.0 * std::sqrt(6.0 * double(change.size())) * condition(shop) * norm;
    for (std::size_t e = 0; e < start.size(); ++e)
        EXPECT_NEAR(found(e, 0), start[e].value + expected[e], rounding * start[e].standard_uncertainty);
}

TEST(BatchGain, OneStepIsOffBySecondOrder) {
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

}  // namespace
