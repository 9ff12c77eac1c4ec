// What a compensator is not made of, and how it says so.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/text_file.hpp"
#include "support/random_machine.hpp"
#include "support/refuses.hpp"

namespace stepdiag {
namespace {

using Spoil = std::function<void(ParameterTable&)>;

void expect_table_refused(const Spoil& spoil, const std::string& culprit) {
    ParameterTable table = random_table(4);
    spoil(table);
    expect_refused([&] { Compensator(table, "table.csv", test_chain); }, culprit);
}

void expect_option_refused(const std::function<void(CompensatorOptions&)>& spoil, const std::string& culprit) {
    CompensatorOptions options;
    spoil(options);
    expect_refused([&] { Compensator(random_table(4), "table.csv", test_chain, options); }, culprit);
}

TEST(CompensatorRefuses, ATableThatDoesNotSayWhatItIsOf) {
    for (const char* key : {"chain", "volume_mm", "tool_mm"}) {
        expect_table_refused([&](ParameterTable& t) { t.header.erase(key); }, key);
        for (const char* text : {"", "1 2", "1 2 3 4", "a b c", "nan nan nan", "1e999 1 1"})
            expect_table_refused([&](ParameterTable& t) { t.header[key] = text; }, key);
    }
    for (const char* text : {"-800 600 500", "0 600 500", "800 600 1e6", "1e-9 600 500"})
        expect_table_refused([&](ParameterTable& t) { t.header["volume_mm"] = text; }, "volume_mm");
    expect_table_refused([](ParameterTable& t) { t.header["tool_mm"] = "0 0 1001"; }, "largest_tool");
}

TEST(CompensatorRefuses, ATableOfAnotherMachine) {
    expect_refused([] { Compensator(random_table(4), "table.csv", "wY'bXZt"); },
                   "table.csv: chain: expected the controller's [w Y' b X Z t], got [w X' b Y Z t]");
    expect_refused([] { Compensator(random_table(4), "table.csv", "XYZ"); }, "chain \"XYZ\"");
}

TEST(CompensatorRefuses, ATableWithoutParameters) {
    expect_table_refused(
        [](ParameterTable& t) {
            t.functions = {};
            t.squarenesses = {};
        },
        "table.csv: expected at least one of the 21 parameters");
}

TEST(CompensatorRefuses, ValuesThatAreNone) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        expect_table_refused([&](ParameterTable& t) { t.functions[7]->value[2] = bad; }, "table.csv: EYY");
        expect_table_refused([&](ParameterTable& t) { t.functions[7]->position[2] = bad; }, "table.csv: EYY");
        expect_table_refused([&](ParameterTable& t) { t.squarenesses[1]->value = bad; }, "table.csv: B0Z");
    }
    expect_table_refused([](ParameterTable& t) { std::swap(t.functions[0]->position[1], t.functions[0]->position[2]); },
                         "table.csv: EXX: positions must ascend");
    expect_table_refused([](ParameterTable& t) { t.functions[0] = FunctionTable{}; }, "table.csv: EXX");
}

TEST(CompensatorRefuses, PositionsInOtherUnits) {
    for (const double factor : {1e-3, 1e3, -1.0 / 4.0})
        expect_table_refused(
            [&](ParameterTable& t) {
                std::vector<double> scaled;
                for (const double p : t.functions[0]->position) scaled.push_back(factor * p);
                std::sort(scaled.begin(), scaled.end());
                t.functions[0]->position = scaled;
            },
            "table.csv: EXX: expected nodes over the volume's edge");
}

TEST(CompensatorRefuses, ErrorsThatNoMachineHas) {
    expect_table_refused([](ParameterTable& t) { t.functions[0]->value[2] = 40.0; }, "change by less than 0.1");
    expect_table_refused([](ParameterTable& t) { t.functions[3]->value[2] = 0.01; }, "axis X: expected rotations");
    expect_table_refused([](ParameterTable& t) { t.squarenesses[0]->value = 0.2; }, "change by less than 0.1");
    expect_table_refused([](ParameterTable& t) { t.functions[0]->value[2] = 1e308; }, "change by less than 0.1");
    // A step between neighbouring numbers.
    expect_table_refused(
        [](ParameterTable& t) {
            t.functions[0]->position[2] = std::nextafter(t.functions[0]->position[1], 1e9);
            t.functions[0]->value[2] = t.functions[0]->value[1] + 1e-6;
        },
        "change by less than 0.1");
}

TEST(CompensatorRefuses, MoreNodesThanItHolds) {
    expect_table_refused(
        [](ParameterTable& t) {
            FunctionTable& exx = *t.functions[0];
            exx.position.clear();
            for (int i = 0; i <= 200'000; ++i) exx.position.push_back(0.004 * i);
            exx.value.assign(exx.position.size(), 0.0);
            exx.standard_uncertainty.assign(exx.position.size(), std::nullopt);
        },
        "axis X: expected at most 100000 different nodes");
}

TEST(CompensatorRefuses, OptionsThatMakeNoSense) {
    const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {nan, infinity, 1e6}) {
        expect_option_refused([&](CompensatorOptions& o) { o.origin[1] = bad; }, "origin");
        expect_option_refused([&](CompensatorOptions& o) { o.largest_tool = bad; }, "largest_tool");
        expect_option_refused([&](CompensatorOptions& o) { o.margin = bad; }, "margin");
    }
    for (const double bad : {nan, 0.0, -1.0, infinity})
        expect_option_refused([&](CompensatorOptions& o) { o.largest_correction = bad; }, "largest_correction");
    expect_option_refused([](CompensatorOptions& o) { o.margin = -1.0; }, "margin");
    expect_option_refused([](CompensatorOptions& o) { o.margin = 1.0; }, "margin: expected 0 unless outside is linear");
    expect_option_refused(
        [](CompensatorOptions& o) {
            o.outside = Outside::linear;
            o.margin = 501.0;
        },
        "margin");
    for (const int bad : {-1, 3, 1 << 30}) {
        expect_option_refused([&](CompensatorOptions& o) { o.outside = Outside(bad); }, "outside");
        expect_option_refused([&](CompensatorOptions& o) { o.approach = CompensatedApproach(bad); }, "approach");
    }
}

TEST(CompensatorRefuses, FilesThatAreNoTables) {
    expect_refused([] { Compensator::load("/nowhere/table.csv", test_chain); }, "/nowhere/table.csv");
    expect_refused([] { Compensator::load("/", test_chain); }, "expected a file");
    const std::string path = ::testing::TempDir() + "no_table.csv";
    for (const char* text : {"", "\n\n", "not a table\n", "parameter,position_mm,value,unit\n", "\xFF\xFE"}) {
        write_text_file(path, text);
        expect_refused([&] { Compensator::load(path, test_chain); }, path);
    }
}

}  // namespace
}  // namespace stepdiag
