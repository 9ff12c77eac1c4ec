// The compensator with the temperatures of the scales.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "stepdiag/controller/compensator.h"
#include "support/random_machine.hpp"
#include "support/refuses.hpp"

namespace stepdiag {
namespace {

constexpr unsigned not_taken = compensation_refused | compensation_temperature;

CompensatorOptions range(double lowest = 5.0, double highest = 45.0) {
    CompensatorOptions options;
    options.temperatures = {lowest, highest};
    return options;
}

TEST(CompensatorTemperature, ErrorIsThatOfTheMachineWhoseScalesExpandInEveryChain) {
    const Approaches forward = {Approach::positive, Approach::positive, Approach::positive};
    for (const std::string& chain : all_chains()) {
        const ParameterTable table = expanding(random_table(7, chain));
        const Compensator compensator(table, "table", chain, range());
        EXPECT_EQ(compensator.temperature_reference(), 20.0);
        const Machine machine(Chain::parse(chain), ErrorMap(table), test_tool);
        for (const Position& warm : {Position{23.0, 31.0, 8.0}, Position{45.0, 5.0, 20.0}})
            for (const Position& p : random_positions(20)) {
                const MachineError e = compensator.error(p, position(test_tool), warm);
                EXPECT_EQ(e.status, 0u);
                const Eigen::Vector3d shift = test_expansion.shift(vector(p), vector(warm));
                const Eigen::Vector3d actual = machine.pose(vector(p), forward, shift).position;
                EXPECT_NEAR((vector(e.position) - (actual - vector(p) - test_tool)).norm(), 0.0, machine_rounding);
                EXPECT_EQ(e.orientation, compensator.error(p, position(test_tool)).orientation);
            }
    }
}

TEST(CompensatorTemperature, ForwardOfCommandIsTheTarget) {
    for (const std::string& chain : all_chains())
        for (const Outside what : {Outside::hold, Outside::linear, Outside::refuse}) {
            CompensatorOptions options = range(-100.0, 200.0);
            options.outside = what;
            options.margin = what == Outside::linear ? 30.0 : 0.0;
            options.origin = {-400.0, 1000.0, 1.0 / 3.0};
            const Compensator compensator(expanding(random_table(50, chain)), "table", chain, options);
            int answered = 0, capped = 0;
            for (Position target : random_positions(200, 40.0)) {
                for (int a = 0; a < 3; ++a) target[a] += options.origin[a];
                const Position warm = {-100.0 + 0.3 * answered, 200.0 - 0.3 * answered, 23.0};
                const CompensatedPosition command = compensator.command(target, compensator.tool(), warm);
                if (command.status & compensation_refused) continue;
                ++answered, capped += (command.status & compensation_capped) != 0;
                const CompensatedPosition back = compensator.forward(command.position, compensator.tool(), warm);
                EXPECT_EQ(back.status, command.status);
                EXPECT_LE(distance(back.position, target), compensator.inverse_bound());
            }
            EXPECT_GT(answered, 80);
            EXPECT_GT(capped, 10);  // 1 mm is reached at 180 K
        }
}

TEST(CompensatorTemperature, WithoutTemperaturesNothingChanges) {
    const Compensator plain(random_table(), "table", test_chain);
    const Compensator expands(expanding(random_table()), "table", test_chain, range());
    for (const Position& p : random_positions(200, 10.0)) {
        const MachineError e = plain.error(p, plain.tool()), same = expands.error(p, plain.tool());
        EXPECT_EQ(same.position, e.position);
        EXPECT_EQ(same.orientation, e.orientation);
        EXPECT_EQ(same.status, e.status);
        EXPECT_EQ(expands.command(p, plain.tool()).position, plain.command(p, plain.tool()).position);
        EXPECT_EQ(expands.forward(p, plain.tool()).position, plain.forward(p, plain.tool()).position);
        Position null_temperature;
        expands.command(p.data(), nullptr, nullptr, null_temperature.data());
        EXPECT_EQ(null_temperature, plain.command(p, plain.tool()).position);
        EXPECT_EQ(expands.error(p, plain.tool(), {20.0, 20.0, 20.0}).position, e.position);  // scales add 0 there
    }
}

TEST(CompensatorTemperature, WhatIsOutsideTheRangeIsRefusedAndReturnedAsItCame) {
    const Compensator compensator(expanding(random_table()), "table", test_chain, range(10.0, 30.0));
    const Position p = {100.0, 200.0, 300.0}, tool = compensator.tool(), nothing = {0.0, 0.0, 0.0};
    EXPECT_EQ(compensator.error(p, tool, {10.0, 30.0, 20.0}).status, 0u);
    for (const double bad : {9.999, 30.001, std::nan(""), std::numeric_limits<double>::infinity(), -1e300})
        for (int axis = 0; axis < 3; ++axis) {
            Position warm = {20.0, 20.0, 20.0};
            warm[axis] = bad;
            EXPECT_EQ(compensator.error(p, tool, warm).status, not_taken);
            EXPECT_EQ(compensator.error(p, tool, warm).position, nothing);
            EXPECT_EQ(compensator.error(p, tool, warm).orientation, nothing);
            EXPECT_EQ(compensator.command(p, tool, warm).status, not_taken);
            EXPECT_EQ(compensator.command(p, tool, warm).position, p);
            EXPECT_EQ(compensator.forward(p, tool, warm).status, not_taken);
            EXPECT_EQ(compensator.forward(p, tool, warm).position, p);
        }
    const Compensator off(expanding(random_table()), "table", test_chain);
    EXPECT_TRUE(std::isnan(off.temperature_reference()));
    EXPECT_EQ(off.command(p, tool, {20.0, 20.0, 20.0}).status, not_taken);
}

void expect_refused_table(const std::map<std::string, std::string>& header, const std::string& culprit) {
    ParameterTable table = random_table(4);
    table.header.insert(header.begin(), header.end());
    expect_refused([&] { Compensator(table, "table.csv", test_chain, range()); }, culprit);
}

TEST(CompensatorTemperature, ATableThatIsNotReferredByAKnownExpansionTakesNone) {
    expect_refused_table({}, "table.csv: for compensation by temperatures");
    expect_refused_table({}, "got neither");
    expect_refused_table({{"temperature_as_found_c", "23.1 23.0 22.8"}}, "got errors as found at 23.1 23.0 22.8");
    expect_refused_table({{"temperature_reference_c", "20"}}, "got no expansion");
    expect_refused_table({{"expansion_per_k", "1e-5 1e-5 1e-5"}}, "table.csv: temperature_reference_c: expected");
    for (const char* text : {"", "1e-5", "a b c", "1 1 1"})
        expect_refused_table({{"temperature_reference_c", "20"}, {"expansion_per_k", text}}, "expansion");
    for (const char* text : {"warm", "nan"})
        expect_refused_table({{"temperature_reference_c", text}, {"expansion_per_k", "1e-5 1e-5 1e-5"}}, "reference");
}

TEST(CompensatorTemperature, ARangeThatIsNoneIsRefused) {
    for (const auto& [lowest, highest] : {std::pair(30.0, 10.0), std::pair(20.0, 20.0), std::pair(283.0, 303.0),
                                          std::pair(std::nan(""), 30.0), std::pair(0.0, std::nan(""))})
        expect_refused(
            [&, at = range(lowest, highest)] { Compensator(expanding(random_table(4)), "table.csv", test_chain, at); },
            "temperatures: expected");
    // 1e-3 per kelvin and 180 K: an error that changes by 0.18 mm/mm.
    ParameterTable steep = expanding(random_table(4));
    steep.header["expansion_per_k"] = "1e-3 0 0";
    expect_refused([&] { Compensator(steep, "table.csv", test_chain, range(0.0, 200.0)); }, "change by less than");
}

TEST(CompensatorTemperature, TheFingerprintTellsTheExpansion) {
    const auto of = [](const ParameterTable& table, const CompensatorOptions& options = {}) {
        return Compensator(table, "table", test_chain, options).fingerprint();
    };
    const std::uint64_t plain = of(random_table()), expands = of(expanding(random_table()));
    EXPECT_NE(plain, expands);
    EXPECT_EQ(of(expanding(random_table()), range()), expands);
    for (const auto& [key, other] : {std::pair("temperature_reference_c", "20.5"), std::pair("fixed_point_mm", "0 0 0"),
                                     std::pair("expansion_per_k", "1.15e-05 2.38e-05 0")}) {
        ParameterTable changed = expanding(random_table());
        changed.header[key] = other;
        EXPECT_NE(of(changed), expands) << key;
    }
    ParameterTable found = random_table();
    found.header["temperature_as_found_c"] = "23 23 23";
    EXPECT_EQ(of(found), plain);
}

TEST(CompensatorTemperature, TheCInterfaceSaysTheSame) {
    const std::string path = ::testing::TempDir() + "temperature_test.csv";
    write_parameter_table(expanding(random_table()), path);
    stepdiag_options options = stepdiag_default_options();
    EXPECT_EQ(options.temperatures[0], 0.0);
    EXPECT_EQ(options.temperatures[1], 0.0);
    options.temperatures[0] = 5.0, options.temperatures[1] = 45.0;
    stepdiag_compensator* c = stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, nullptr, 0);
    ASSERT_NE(c, nullptr);
    const Compensator cpp(expanding(random_table()), "table", test_chain, range());
    EXPECT_EQ(stepdiag_temperature_reference(c), 20.0);
    EXPECT_TRUE(std::isnan(stepdiag_temperature_reference(nullptr)));
    const Position warm = {26.0, 18.5, 31.0}, hot = {26.0, 18.5, 46.0};
    for (const Position& p : random_positions(50, 10.0)) {
        Position error, orientation, command, actual;
        EXPECT_EQ(stepdiag_error_at_temperature(c, p.data(), nullptr, warm.data(), error.data(), orientation.data()),
                  cpp.error(p, cpp.tool(), warm).status);
        EXPECT_EQ(error, cpp.error(p, cpp.tool(), warm).position);
        EXPECT_EQ(orientation, cpp.error(p, cpp.tool(), warm).orientation);
        stepdiag_command_at_temperature(c, p.data(), nullptr, warm.data(), command.data());
        EXPECT_EQ(command, cpp.command(p, cpp.tool(), warm).position);
        stepdiag_forward_at_temperature(c, command.data(), nullptr, warm.data(), actual.data());
        EXPECT_EQ(actual, cpp.forward(command, cpp.tool(), warm).position);
        stepdiag_command_at_temperature(c, p.data(), nullptr, nullptr, command.data());
        EXPECT_EQ(command, cpp.command(p, cpp.tool()).position);
        EXPECT_EQ(stepdiag_command_at_temperature(c, p.data(), nullptr, hot.data(), command.data()),
                  unsigned(STEPDIAG_REFUSED | STEPDIAG_TEMPERATURE));
        EXPECT_EQ(command, p);
        EXPECT_EQ(stepdiag_error_at_temperature(c, p.data(), nullptr, hot.data(), nullptr, nullptr), not_taken);
    }
    EXPECT_EQ(stepdiag_forward_at_temperature(nullptr, warm.data(), nullptr, warm.data(), nullptr),
              unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_forward_at_temperature(c, nullptr, nullptr, warm.data(), nullptr), unsigned(STEPDIAG_REFUSED));
    stepdiag_compensator_free(c);
}

}  // namespace
}  // namespace stepdiag
