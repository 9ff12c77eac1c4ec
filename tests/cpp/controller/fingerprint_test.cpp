#include <gtest/gtest.h>

#include <set>

#include "support/random_machine.hpp"

namespace stepdiag {
namespace {

std::uint64_t fingerprint(const ParameterTable& table, const CompensatorOptions& options = {}) {
    return Compensator(table, "table", table.header.at("chain"), options).fingerprint();
}

TEST(Fingerprint, IsThatOfTheNumbersAndNotOfTheirSpelling) {
    ParameterTable table = random_table(3);
    const std::uint64_t original = fingerprint(table);
    table.header["chain"] = "wX'bYZt";
    table.header["volume_mm"] = "8e2 600 +500.00";
    table.header["date"] = "2026-11-22";
    table.header["method"] = "enhanced";
    table.functions[4]->standard_uncertainty[1] = 1e-6;
    EXPECT_EQ(fingerprint(table), original);
    EXPECT_EQ(fingerprint(parse_parameter_table(format_parameter_table(table), "table")), original);
    table.functions[0]->value[0] = -0.0;
    EXPECT_EQ(fingerprint(table), original);
    CompensatorOptions options;
    options.origin = {1.0, 2.0, 3.0};
    EXPECT_EQ(fingerprint(table, options), original);
}

TEST(Fingerprint, ChangesWithEveryNumber) {
    const ParameterTable table = random_table(3);
    std::set<std::uint64_t> seen = {fingerprint(table)};
    const auto expect_another = [&](const auto& change) {
        ParameterTable changed = table;
        change(changed);
        EXPECT_TRUE(seen.insert(fingerprint(changed)).second);
    };
    for (int i = 0; i < function_count; ++i) {
        expect_another([&](ParameterTable& t) { t.functions[i].reset(); });
        expect_another([&](ParameterTable& t) { t.negative_functions[i] = t.functions[i]; });
        for (int k = 0; k < 4; ++k) {
            expect_another([&](ParameterTable& t) { t.functions[i]->value[k] += 1e-12; });
            expect_another([&](ParameterTable& t) { t.functions[i]->position[k] += 1e-9; });
        }
    }
    for (int i = 0; i < squareness_count; ++i) {
        expect_another([&](ParameterTable& t) { t.squarenesses[i]->value *= 1.0 + 1e-15; });
        expect_another([&](ParameterTable& t) { t.squarenesses[i].reset(); });
    }
    expect_another([](ParameterTable& t) { t.header["chain"] = "wX'bZYt"; });
    expect_another([](ParameterTable& t) { t.header["volume_mm"] = "800 600 500.000001"; });
    expect_another([](ParameterTable& t) { t.header["tool_mm"] = "5 -3 80.1"; });
}

TEST(Fingerprint, IsTheSameOnEveryMachineAndInEveryVersion) {
    ParameterTable table;
    table.functions[0] = FunctionTable{{0.0, 800.0}, {0.0, 0.01}, {std::nullopt, std::nullopt}};
    EXPECT_EQ(fingerprint(with_header(table)),
              7928635067038002598u);  // tests/python/controller/test_compensator.py computes it by itself
}

}  // namespace
}  // namespace stepdiag
