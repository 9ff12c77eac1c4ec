#include "evaluation/linear_program.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace stepdiag {
namespace {

// Results of one set of inputs in every lane, lane l times (l + 1).
std::vector<double> run(const LinearProgram& program, const std::vector<double>& inputs) {
    std::vector<double> registers(program.registers() * program_lanes, 0.0);
    for (std::size_t i = 0; i < inputs.size(); ++i)
        for (std::size_t lane = 0; lane < program_lanes; ++lane)
            registers[i * program_lanes + lane] = double(lane + 1) * inputs[i];
    std::vector<double> values(program.outputs() * program_lanes);
    program.run(registers.data(), values.data(), program_lanes);
    return values;
}

std::vector<Traced> traced_inputs(ProgramBuilder& builder) {
    std::vector<Traced> inputs;
    for (std::size_t i = 0; i < builder.inputs(); ++i) inputs.emplace_back(builder, int(i));
    return inputs;
}

TEST(LinearProgram, DoesWhatWasComputedWithTracedNumbers) {
    ProgramBuilder builder(4);
    auto x = traced_inputs(builder);
    Traced difference = 2.0 * (x[1] - x[0]);
    settle(difference);
    Traced sum = Traced::Zero();
    sum += difference;
    sum -= 0.5 * x[2];
    settle(sum);
    Traced half = (sum + difference) / 2.0;
    settle(half);
    const LinearProgram program = builder.build({half.place(), sum.place()});
    const auto values = run(program, {1.0, 4.0, 10.0, 7.0});
    for (std::size_t lane = 0; lane < program_lanes; ++lane) {
        EXPECT_DOUBLE_EQ(values[lane], 3.5 * double(lane + 1));
        EXPECT_DOUBLE_EQ(values[program_lanes + lane], 1.0 * double(lane + 1));
    }
}

TEST(LinearProgram, OutputsMayBeZeroInputsOrTheSamePlace) {
    ProgramBuilder builder(2);
    auto x = traced_inputs(builder);
    Traced nothing = Traced::Zero(), sum = x[0] + x[1], cancelled = x[0] - x[0];
    settle(nothing), settle(sum), settle(cancelled);
    EXPECT_EQ(nothing.place(), -1);
    const LinearProgram program =
        builder.build({nothing.place(), x[1].place(), sum.place(), sum.place(), cancelled.place()});
    const auto values = run(program, {3.0, 5.0});
    const double expected[] = {0.0, 5.0, 8.0, 8.0, 0.0};
    for (std::size_t o = 0; o < 5; ++o)
        for (std::size_t lane = 0; lane < program_lanes; ++lane)
            EXPECT_EQ(values[o * program_lanes + lane], expected[o] * double(lane + 1));
}

TEST(LinearProgram, WhatNoOutputNeedsIsLeftOut) {
    ProgramBuilder builder(3);
    auto x = traced_inputs(builder);
    Traced unused = 3.0 * x[0] + x[2], used = 2.0 * x[1];
    settle(unused), settle(used);
    EXPECT_EQ(builder.build({used.place()}).multiplications(), 1u);
}

TEST(LinearProgram, DifferencesCostOneMultiplicationARow) {
    ProgramBuilder builder(8);
    auto x = traced_inputs(builder);
    Traced running[3];
    std::vector<int> outputs;
    for (int step = 0; step < 4; ++step)
        for (int r = 0; r < 3; ++r) {
            for (int i = 0; i < 4; ++i) running[r] += (0.3 + r + 5.0 * i) * (x[2 * i + 1] - x[2 * i]);
            settle(running[r]);
            outputs.push_back(running[r].place());
        }
    const LinearProgram program = builder.build(outputs);
    EXPECT_EQ(program.multiplications(), 4u * 3u * 4u);
    ASSERT_EQ(program.blocks().size(), 1u);  // one loop over four blocks of three rows
    EXPECT_EQ(program.blocks()[0].count, 4u);
}

// A program of random rows, long enough for places to be used again, against the dense matrix that they make.
TEST(LinearProgram, RandomRowsGiveTheDenseMatrixTheyMake) {
    std::mt19937 random(5);
    const auto number = [&]() { return std::uniform_real_distribution<>(-1.0, 1.0)(random); };
    for (int round = 0; round < 30; ++round) {
        const int inputs = 12, rows = 150;
        ProgramBuilder builder(inputs);
        auto x = traced_inputs(builder);
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(inputs + rows, inputs);
        dense.topRows(inputs).setIdentity();
        std::vector<int> outputs;
        for (int row = 0; row < rows; ++row) {
            const int known = inputs + row;
            Traced sum;
            Eigen::RowVectorXd expected = Eigen::RowVectorXd::Zero(inputs);
            const auto add = [&](double coefficient, int place) {
                sum += coefficient * x[std::size_t(place)];
                expected += coefficient * dense.row(place);
            };
            for (int t = int(random() % 6); t >= 0; --t) {
                const int place = known - 1 - int(random() % std::min(known, 40));
                const double coefficient = random() % 3 ? 0.4 * number() : random() % 2 ? 1.0 : -1.0;
                add(coefficient, place);
                if (random() % 2) add(-coefficient, int(random() % inputs));
            }
            settle(sum);
            dense.row(known) = expected;
            x.push_back(sum);
            outputs.push_back(random() % 4 ? -1 : sum.place());
        }
        const LinearProgram program = builder.build(outputs);
        EXPECT_LT(program.registers(), std::size_t(inputs + rows));
        std::vector<double> values(inputs);
        for (double& value : values) value = number();
        const Eigen::VectorXd expected = dense * Eigen::Map<const Eigen::VectorXd>(values.data(), inputs);
        const auto found = run(program, values);
        for (int row = 0; row < rows; ++row)
            for (std::size_t lane = 0; lane < program_lanes; ++lane)
                EXPECT_NEAR(found[std::size_t(row) * program_lanes + lane],
                            outputs[std::size_t(row)] < 0 ? 0.0 : double(lane + 1) * expected[inputs + row],
                            1e-10 * (1.0 + std::abs(expected[inputs + row])));  // rounding, in sums of a hundred rows
    }
}

}  // namespace
}  // namespace stepdiag
