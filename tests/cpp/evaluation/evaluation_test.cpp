// The evaluators on runs with known truth, as a C++ caller uses them. (The Python tests go further; these also run
// under the sanitizers.)
#include <gtest/gtest.h>

#include <cmath>

#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector3d;
using stepdiag::Calibration;
using stepdiag::Chain;
using stepdiag::FunctionId;
using stepdiag::HeadCalibration;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::Plan;
using stepdiag::test::chain;
using stepdiag::test::diagonals;
using stepdiag::test::lines;
using stepdiag::test::scale_lines;
using stepdiag::test::volume;

const Vector3d no_tool = Vector3d::Zero();

Plan plan(std::vector<Line> lines, int steps) {
    return Plan(volume, std::move(lines), steps, stepdiag::all_axes, scale_lines);
}

std::string file(const std::string& name) {
    return STEPDIAG_TEST_DATA "/../../python/stepdiag/selftest/known/runs/" + name;
}

struct Worst {
    double position = 0.0, angle = 0.0;
};

Worst worst(const Calibration& calibration, const stepdiag::ErrorMap& truth) {
    Worst worst;
    for (int i = 0; i < stepdiag::function_count; ++i) {
        if (!calibration.functions[i]) continue;
        const auto& function = *calibration.functions[i];
        double& largest = FunctionId::at(i).is_rotation() ? worst.angle : worst.position;
        for (std::size_t k = 0; k < function.position.size(); ++k)
            largest = std::max(largest,
                               std::abs(function.value[k] - truth.function(FunctionId::at(i), function.position[k])));
    }
    return worst;
}

Measurement without(const Measurement& run, const char* line, int point) {
    auto channels = run.channels();
    for (std::size_t i = 0; i < run.size(); ++i)
        if (run.stations()[i].line.name() == line && run.stations()[i].point == point)
            for (auto& channel : channels) channel.value[i].reset();
    return Measurement(run.stations(), channels);
}

}  // namespace

TEST(Evaluation, EnhancedRecoversTheCleanRun) {
    const auto run = stepdiag::read_measurement(file("clean/measurement.csv"));
    const auto truth = stepdiag::read_error_map(file("clean/truth.csv"));
    const auto four = plan(diagonals, 20);
    const auto error = worst(evaluate_enhanced(run, four, chain, no_tool, {}), truth);
    EXPECT_LE(error.position, 15e-6);  // second order: some products of 60 urad with 60 urad over 1 m
    EXPECT_LE(error.angle, 5e-9);
    EXPECT_GE(worst(evaluate_conventional(run, four, chain, no_tool, {}), truth).position, 10e-3);
}

TEST(Evaluation, EnhancedReducesThreeBeams) {
    const auto run = stepdiag::read_measurement(file("three_beams/measurement.csv"));
    const auto truth = stepdiag::read_error_map(file("three_beams/truth.csv"));
    const HeadCalibration head{0.0, {{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}}};
    const auto calibration =
        evaluate_enhanced(run, plan(lines({"ppp", "npp", "pnp"}), 12), Chain::parse("[w b Z X Y t]"), no_tool, head);
    EXPECT_LE(worst(calibration, truth).position, 2.5e-3);  // laser angles of 1.2 mrad
    EXPECT_LE(worst(calibration, truth).angle, 50e-9);
    EXPECT_TRUE(calibration.findings.empty());
}

TEST(Evaluation, LostReadingIsBridgedByFourLinesAndSaidByThree) {
    const auto truth = stepdiag::make_random_error_map(volume, {});
    for (const auto& measured : {diagonals, lines({"ppp", "npp", "pnp"})}) {
        const auto p = plan(measured, 8);
        const auto run = without(simulate({chain, truth, no_tool}, p, {}), "ppp", 7);
        const auto calibration = evaluate_enhanced(run, p, chain, no_tool, {});
        EXPECT_LE(worst(calibration, truth).position, 20e-6);
        EXPECT_LE(worst(calibration, truth).angle, 10e-9);
        EXPECT_EQ(calibration.findings.empty(), measured.size() == 4);
        EXPECT_EQ(calibration.functions[0].has_value(), measured.size() == 4);
    }
}

TEST(Evaluation, CovarianceHasTheStandardUncertaintiesOnItsDiagonal) {
    const auto p = plan(diagonals, 5);
    const auto run = simulate({chain, stepdiag::make_random_error_map(volume, {}), no_tool}, p, {});
    stepdiag::EvaluationOptions options;
    options.full_covariance = true;
    for (const auto evaluate : {&stepdiag::evaluate_enhanced, &stepdiag::evaluate_conventional}) {
        const auto calibration = evaluate(run, p, chain, no_tool, {}, options);
        std::vector<double> u;
        for (const auto& function : calibration.functions)
            if (function)
                u.insert(u.end(), function->standard_uncertainty.begin(), function->standard_uncertainty.end());
        for (const auto& squareness : calibration.squarenesses)
            if (squareness) u.push_back(squareness->standard_uncertainty);
        ASSERT_EQ(calibration.covariance.rows(), Eigen::Index(u.size()));
        for (std::size_t i = 0; i < u.size(); ++i)  // the same squares in another order
            EXPECT_NEAR(std::sqrt(calibration.covariance(Eigen::Index(i), Eigen::Index(i))), u[i],
                        1e-12 * u[i] + 1e-18);
    }
}

TEST(Evaluation, ReadingsOfAnotherPlanAreRefused) {
    const auto run = stepdiag::read_measurement(file("clean/measurement.csv"));
    for (const auto evaluate : {&stepdiag::evaluate_enhanced, &stepdiag::evaluate_conventional}) {
        expect_refused([&] { evaluate(run, plan(diagonals, 19), chain, no_tool, {}, {}); }, "row");
        expect_refused([&] { evaluate(run, plan(lines({"ppp", "npp"}), 20), chain, no_tool, {}, {}); }, "row");
        expect_refused([&] { evaluate(run, plan(diagonals, 20), chain, {0, 0, NAN}, {}, {}); }, "tool");
    }
    const auto raw = stepdiag::read_measurement(file("three_beams/measurement.csv"));
    expect_refused([&] { evaluate_enhanced(raw, plan(lines({"ppp", "npp", "pnp"}), 12), chain, no_tool, {}); }, "beam");
}
