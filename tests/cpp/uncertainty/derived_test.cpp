#include "stepdiag/uncertainty/derived.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stepdiag/uncertainty/volumetric_accuracy.hpp"
#include "support/refuses.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace stepdiag;

const Vector3d volume(800, 600, 500);
const Vector3d tool(20, -30, -150);

// The tables of a random machine as a calibration, with a random covariance.
Calibration make_calibration(const char* chain, unsigned seed, int intervals = 6) {
    RandomErrorMap options;
    options.seed = seed;
    options.intervals = intervals;
    const ParameterTable table = make_random_error_map(volume, options).table();
    Calibration calibration{"test", Chain::parse(chain), volume, tool, {}, {}, {}, {}};
    for (int i = 0; i < function_count; ++i) {
        const FunctionTable& function = *table.functions[i];
        calibration.functions[i] = CalibratedFunction{function.position, function.value, {}};
    }
    for (int i = 0; i < squareness_count; ++i)
        calibration.squarenesses[i] = CalibratedSquareness{table.squarenesses[i]->value, 0.0};
    const Eigen::Index n = calibration_values(calibration).size();
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    MatrixXd root(n, n / 2);
    for (auto& x : root.reshaped()) x = 1e-7 * normal(engine);
    calibration.covariance = root * root.transpose();
    for (auto& function : calibration.functions) function->standard_uncertainty.assign(intervals + 1, 0.0);
    return calibration;
}

Machine machine_of(const Calibration& calibration, const Vector3d& offset) {
    return Machine(calibration.chain, ErrorMap(to_parameter_table(calibration)), offset);
}

constexpr const char* chains[] = {"[w X' b Y Z t]", "[w b X Y Z t]", "[w Y' X' b Z t]", "[w Z' Y' X' b t]"};

}  // namespace

TEST(Derived, EntriesAreThoseOfTheCovariance) {
    const Calibration calibration = make_calibration(chains[0], 1);
    const auto entries = calibration_entries(calibration);
    ASSERT_EQ(Eigen::Index(entries.size()), calibration.covariance.rows());
    EXPECT_EQ(entries[0].parameter, "EXX");
    EXPECT_EQ(entries[1].position, volume.x() / 6);
    EXPECT_EQ(entries.back().parameter, "A0Z");
    EXPECT_TRUE(std::isnan(entries.back().position));
    EXPECT_EQ(calibration_values(calibration)[1], calibration.functions[0]->value[1]);
    EXPECT_EQ(calibration_values(calibration).tail(1)[0], calibration.squarenesses[2]->value);
}

TEST(Derived, ErrorAtAnyPointIsTheMachinesToFirstOrder) {
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> uniform(-0.2, 1.2);  // outside the tables as well
    for (const char* chain : chains) {
        const Calibration calibration = make_calibration(chain, 3);
        for (int i = 0; i < 20; ++i) {
            const Vector3d point = volume.cwiseProduct(Vector3d(uniform(engine), uniform(engine), uniform(engine)));
            const Vector3d offset(100 * uniform(engine), 5.0, -200 * uniform(engine));
            const ErrorAtPoint error = error_at_point(calibration, point, offset);
            const Machine machine = machine_of(calibration, offset);
            // Sums of twenty terms of 0.05 mm.
            EXPECT_LE((error.value.head<3>() - machine.first_order_error(point)).norm(), 1e-15) << chain;
            Vector3d turn = Vector3d::Zero();
            for (const Axis axis : all_axes) turn += machine.errors().theta(axis, point[index(axis)]);
            EXPECT_LE((error.value.tail<3>() - turn).norm(), 1e-18);
            const auto rows = deviation_rows(calibration, offset, point).rows;
            EXPECT_LE((error.covariance - rows * calibration.covariance * rows.transpose()).norm(), 1e-22);
        }
    }
}

TEST(Derived, WhatIsMissingIsNamedWhereItActs) {
    Calibration calibration = make_calibration("[w X' b Y Z t]", 5);
    calibration.covariance = {};
    calibration.functions[FunctionId{Axis::Z, Component::A}.index()].reset();  // lever: the tool
    calibration.squarenesses[0].reset();
    calibration.functions[FunctionId{Axis::X, Component::X}.index()]->slope_determined = false;
    const ErrorAtPoint error = error_at_point(calibration, {100, 200, 300});
    EXPECT_EQ(error.missing[0], (std::vector<std::string>{"slope of EXX", "C0Y"}));
    EXPECT_EQ(error.missing[1], std::vector<std::string>{"EAZ"});
    EXPECT_EQ(error.missing[2], std::vector<std::string>{"EAZ"});
    EXPECT_EQ(error.missing[3], std::vector<std::string>{"EAZ"});
    for (int c = 0; c < 6; ++c) EXPECT_EQ(std::isnan(error.value[c]), c < 4) << c;
    EXPECT_TRUE(std::isnan(error.covariance(5, 5)));  // the calibration has none
    // Without a lever, without travel: not missed.
    const ErrorAtPoint bare = error_at_point(calibration, {100, 0, 300}, Vector3d(0, 0, 0));
    EXPECT_EQ(bare.missing[0], std::vector<std::string>{"slope of EXX"});
    EXPECT_TRUE(bare.missing[1].empty());
    EXPECT_TRUE(error_at_point(calibration, {0, 0, 0}).missing[0].empty());
}

TEST(Derived, DiagonalErrorsAreThoseOfTheMachineAlongThem) {
    for (const char* chain : chains) {
        const Calibration calibration = make_calibration(chain, 11);
        const Machine machine = machine_of(calibration, tool);
        for (const DiagonalErrors& diagonal : diagonal_errors(calibration)) {
            ASSERT_EQ(diagonal.value.size(), 7);
            const Vector3d start = diagonal.point.row(0), end = diagonal.point.row(6);
            const Vector3d direction = (end - start).normalized();
            EXPECT_NEAR(diagonal.travel[6], volume.norm(), 1e-12);
            for (int k = 0; k < 7; ++k) {
                const Vector3d point = diagonal.point.row(k);
                EXPECT_NEAR(diagonal.travel[k], (point - start).norm(), 1e-12);
                const Vector3d relative = machine.first_order_error(point) - machine.first_order_error(start);
                EXPECT_NEAR(diagonal.value[k], direction.dot(relative), 1e-15);
            }
            EXPECT_EQ(diagonal.covariance(0, 0), 0.0);
            EXPECT_GT(diagonal.standard_uncertainty()[3], 0.0);
            EXPECT_EQ(diagonal.range(), diagonal.value.maxCoeff() - diagonal.value.minCoeff());
        }
    }
}

TEST(Derived, RangesOverTheVolumeAreThoseOfAFineGrid) {
    for (const char* chain : chains) {
        const Calibration calibration = make_calibration(chain, 17, 4);
        const VolumeRanges ranges(calibration, tool);
        const VectorXd values = calibration_values(calibration);
        const Ranges found = ranges.evaluate(values);
        const Machine machine = machine_of(calibration, tool);
        Vector3d low = Vector3d::Constant(1e9), high = -low;
        constexpr int parts = 64;  // a multiple of the intervals' finer ones: these are among them
        for (int i = 0; i <= parts; ++i)
            for (int j = 0; j <= parts; ++j)
                for (int k = 0; k <= parts; ++k) {
                    const Vector3d error =
                        machine.first_order_error(volume.cwiseProduct(Vector3d(i, j, k)) / double(parts));
                    low = low.cwiseMin(error);
                    high = high.cwiseMax(error);
                }
        // Extremes within an interval of axis 1 are missed by up to 22 nm, as `resolution` says of axes 2 and 3.
        for (int c = 0; c < 3; ++c) {
            EXPECT_GE(found[c], high[c] - low[c] - 1e-14) << chain << c;
            EXPECT_LE(found[c], high[c] - low[c] + 3e-5) << chain << c;
        }
        const auto diagonals = diagonal_errors(calibration);
        for (int d = 0; d < 4; ++d) EXPECT_NEAR(found[6 + d], diagonals[d].range(), 1e-15);
        // Exact with one axis that carries the workpiece; with more on the finer grid, here with 100 and 200 mm.
        if (machine.chain().carries_workpiece(machine.chain().order()[1])) EXPECT_LE(ranges.resolution(values), 3e-5);
        else EXPECT_EQ(ranges.resolution(values), 0.0);
    }
}

TEST(Derived, RangesSeeBetweenTheNodesOfAnAxisThatCarriesTheWorkpiece) {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
        const Calibration calibration = make_calibration("[w X' b Y Z t]", seed, 4);
        const Machine machine = machine_of(calibration, tool);
        Vector3d low = Vector3d::Constant(1e9), high = -low;
        for (int i = 0; i <= 4000; ++i)
            for (int j = 0; j <= 4; ++j)
                for (int k = 0; k <= 4; ++k) {
                    const Vector3d error = machine.first_order_error(
                        volume.cwiseProduct(Vector3d(double(i) / 4000, double(j) / 4, double(k) / 4)));
                    low = low.cwiseMin(error);
                    high = high.cwiseMax(error);
                }
        const Ranges found = VolumeRanges(calibration, tool).evaluate(calibration_values(calibration));
        // Parabolas rise by 6 um within 200 mm at most, by a millionth of that within a thousandth.
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], high[c] - low[c], 2e-8) << seed << c;
    }
}

TEST(Derived, NoiseWidensRanges) {
    Calibration calibration = make_calibration("[w X' b Y Z t]", 23);
    const Ranges truth = VolumeRanges(calibration, tool).evaluate(calibration_values(calibration));
    const VolumetricAccuracy accuracy = volumetric_accuracy(calibration, {}, {0.95, 2000, 1});
    for (int i = 0; i < range_count; ++i) {
        EXPECT_EQ(accuracy.value[i], truth[i]);
        EXPECT_GT(accuracy.bias()[i], -3.0 * accuracy.standard_uncertainty[i] / std::sqrt(2000.0));
        EXPECT_LT(accuracy.interval(i, 0), accuracy.interval(i, 1));
        // A range moves by less than the range of what moves it, so that half an interval is below the bound.
        EXPECT_LE(accuracy.interval(i, 1) - accuracy.interval(i, 0), 2.0 * accuracy.bound[i]);
    }
    calibration.covariance *= 0.0;
    const VolumetricAccuracy certain = volumetric_accuracy(calibration, {}, {0.95, 2000, 1});
    EXPECT_LE(certain.standard_uncertainty.maxCoeff(), 1e-15);  // rounding of the mean
    EXPECT_EQ(certain.interval.col(0), certain.value);
    EXPECT_EQ(certain.bound.maxCoeff(), 0.0);
}

TEST(Derived, ModelOfRangesGivesTheSameDrawsInAnyBlocks) {
    const Calibration calibration = make_calibration("[w X' b Y Z t]", 29);
    const RangeModel model(calibration, {}, 5);
    ASSERT_EQ(model.outputs().size(), std::size_t(range_count));
    std::vector<double> all(64 * range_count), part(16 * range_count);
    model.worker()->evaluate({0, 64, all.data()});
    model.worker()->evaluate({32, 16, part.data()});
    for (int i = 0; i < range_count; ++i)
        for (int s = 0; s < 16; ++s) EXPECT_EQ(part[i * 16 + s], all[i * 64 + 32 + s]);
}

TEST(Derived, OutputsOfPointsAndDiagonalsAreRowsOnTheEntries) {
    Calibration calibration = make_calibration("[w X' b Y Z t]", 31);
    const VectorXd values = calibration_values(calibration);
    const auto at_point = derived_at_point(calibration, {400, 300, 250});
    ASSERT_EQ(at_point.size(), 6u);
    EXPECT_EQ(at_point[0].name, "e_X at (400, 300, 250)");
    EXPECT_EQ(at_point[4].unit, "rad");
    const auto with_tool = derived_at_point(calibration, {400, 300, 250}, Vector3d(0, 0, -80));
    EXPECT_EQ(with_tool[1].name, "e_Y at (400, 300, 250) with tool (0, 0, -80)");
    const ErrorAtPoint error = error_at_point(calibration, {400, 300, 250});
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(at_point[c].row.dot(values), error.value[c], 1e-15);
    EXPECT_EQ(derived_on_diagonals(calibration).size(), 28u);
    calibration.squarenesses[0].reset();
    EXPECT_EQ(derived_at_point(calibration, {400, 300, 250}).size(), 5u);
}

TEST(Derived, RefusesWhatMakesNoSense) {
    Calibration calibration = make_calibration("[w X' b Y Z t]", 37);
    expect_refused([&] { error_at_point(calibration, {0, NAN, 0}); }, "point");
    expect_refused([&] { diagonal_errors(calibration, Vector3d(0, 0, INFINITY)); }, "tool");
    expect_refused([&] { volumetric_accuracy(calibration, {}, {1.0, 10'000, 0}); }, "coverage");
    expect_refused([&] { volumetric_accuracy(calibration, {}, {0.95, 1000, 0}); }, "samples");
    calibration.covariance = {};
    expect_refused([&] { volumetric_accuracy(calibration); }, "full covariance");
    expect_refused([&] { RangeModel model(calibration); }, "full covariance");
}
