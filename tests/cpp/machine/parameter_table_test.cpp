#include "stepdiag/machine/parameter_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>

#include "support/refuses.hpp"
#include "support/spoil.hpp"

namespace {

using stepdiag::FunctionTable;
using stepdiag::ParameterTable;
using stepdiag::parse_parameter_table;

std::uint64_t bits(double value) {
    std::uint64_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
}

// A table with values of every size that a double can hold.
ParameterTable extreme_table() {
    std::mt19937_64 engine(9);
    const auto any = [&] {
        for (;;) {
            const std::uint64_t word = engine();
            double value;
            std::memcpy(&value, &word, sizeof value);
            if (std::isfinite(value)) return value;
        }
    };
    ParameterTable table;
    table.header = {{"format", stepdiag::error_map_format}, {"chain", "[w X' b Y Z t]"}};
    for (int i = 0; i < stepdiag::function_count; ++i) {
        FunctionTable function;
        double position = -1e-3 * i;
        for (const double special :
             {0.0, -0.0, 5e-324, 1e-300, 1e300, 1.0 / 3.0, -std::numeric_limits<double>::max()}) {
            for (const double value : {special, any()}) {
                function.position.push_back(position += 1.0 / 3.0);
                function.value.push_back(value);
                function.standard_uncertainty.push_back(i % 2 ? std::optional<double>(std::abs(any())) : std::nullopt);
            }
        }
        if (i != 4) table.functions[i] = function;  // one is missing
        if (i % 5 == 2) {                           // some are others in - direction, at other nodes too
            for (double& value : function.value) value = any();
            function.position.front() -= 1.0 / 7.0;
            table.negative_functions[i] = function;
        }
    }
    table.squarenesses[0] = stepdiag::SquarenessValue{any(), std::nullopt};
    table.squarenesses[2] = stepdiag::SquarenessValue{-0.0, 1e-300};
    return table;
}

void expect_same_bits(const ParameterTable& a, const ParameterTable& b) {
    EXPECT_EQ(a.header, b.header);
    const auto same = [](const std::optional<double>& x, const std::optional<double>& y) {
        return x.has_value() == y.has_value() && (!x || bits(*x) == bits(*y));
    };
    const auto compare = [&](const std::optional<FunctionTable>& x, const std::optional<FunctionTable>& y) {
        ASSERT_EQ(x.has_value(), y.has_value());
        if (!x) return;
        ASSERT_EQ(x->position.size(), y->position.size());
        for (std::size_t k = 0; k < x->position.size(); ++k) {
            EXPECT_EQ(bits(x->position[k]), bits(y->position[k]));
            EXPECT_EQ(bits(x->value[k]), bits(y->value[k]));
            EXPECT_TRUE(same(x->standard_uncertainty[k], y->standard_uncertainty[k]));
        }
    };
    for (int i = 0; i < stepdiag::function_count; ++i) {
        SCOPED_TRACE(i);
        compare(a.functions[i], b.functions[i]);
        compare(a.negative_functions[i], b.negative_functions[i]);
    }
    for (int s = 0; s < stepdiag::squareness_count; ++s) {
        ASSERT_EQ(a.squarenesses[s].has_value(), b.squarenesses[s].has_value());
        if (!a.squarenesses[s]) continue;
        EXPECT_EQ(bits(a.squarenesses[s]->value), bits(b.squarenesses[s]->value));
        EXPECT_TRUE(same(a.squarenesses[s]->standard_uncertainty, b.squarenesses[s]->standard_uncertainty));
    }
}

const std::string header = "parameter,position_mm,value,unit,standard_uncertainty\n";

}  // namespace

TEST(ParameterTable, TextIsReadBackToTheSameBits) {
    const ParameterTable table = extreme_table();
    expect_same_bits(parse_parameter_table(format_parameter_table(table), "t.csv"), table);
}

TEST(ParameterTable, FileIsReadBackToTheSameBits) {
    const std::string path = (std::filesystem::temp_directory_path() / "stepdiag_parameter_table_test.csv").string();
    const ParameterTable table = extreme_table();
    write_parameter_table(table, path);
    expect_same_bits(stepdiag::read_parameter_table(path), table);
    std::filesystem::remove(path);
}

TEST(ParameterTable, ValuesAreInNativeUnits) {
    const auto table =
        parse_parameter_table("# chain=[w b X Y Z t]\n# a remark\n" + header +
                                  "EXX,0,0,um,\nEXX,10.5,2.5,um,0.1\nECZ,3,-7,urad,\nB0Z,,12.5,urad,0.5\n",
                              "t.csv");
    EXPECT_EQ(table.header.at("chain"), "[w b X Y Z t]");
    EXPECT_EQ(table.functions[0]->value, (std::vector<double>{0.0, 2.5e-3}));
    EXPECT_EQ(table.functions[0]->standard_uncertainty[1], 0.1e-3);
    EXPECT_EQ(table.functions[17]->value[0], -7e-6);
    EXPECT_EQ(table.squarenesses[1]->value, 12.5e-6);
    EXPECT_EQ(table.squarenesses[1]->standard_uncertainty, 0.5e-6);
    EXPECT_FALSE(table.functions[1] || table.squarenesses[0] || table.squarenesses[2]);
}

TEST(ParameterTable, ByteOrderMarkAndWindowsLineEndsAreRead) {
    const auto table = parse_parameter_table(
        "\xEF\xBB\xBF# a=b\r\nparameter,position_mm,value,unit,standard_uncertainty\r\nEXX,0,1,um,\r\n", "t.csv");
    EXPECT_EQ(table.functions[0]->value[0], 1e-3);
}

TEST(ParameterTable, MalformedTextIsRefusedWithFileAndLine) {
    const struct {
        std::string text, culprit;
    } cases[] = {
        {"", "t.csv"},
        {"EXX,0,0,um,\n", "line 1"},
        {"parameter,position_mm,value,unit\nEXX,0,0,um\n", "line 1"},
        {"parameter,position_um,value,unit,standard_uncertainty\n", "line 1: unknown column \"position_um\""},
        {"parameter,value,unit,standard_uncertainty\n", "line 1: the column \"position_mm\" is missing"},
        {"unit,parameter,position_mm,value,unit,standard_uncertainty\n", "line 1: the column \"unit\" is given twice"},
        {"# format=stepdiag error map 2\n" + header, "line 1: format: expected \"stepdiag error map 1\" or \"stepdiag"},
        {"# format=stepdiag error map 2\n" + header, "got \"stepdiag error map 2\""},
        {"# chain=a\n# chain=b\n" + header, "line 2: the leading line \"chain\" is given twice"},
        {header + "EXX,0,0,um\n", "line 2"},
        {header + "EXX,0,0,um,,\n", "line 2"},
        {header + "EXQ,0,0,um,\n", "line 2: parameter"},
        {header + "exx,0,0,um,\n", "line 2: parameter"},
        {header + "EXX,0,0,mm,\n", "line 2: unit"},
        {header + "EXX,0,0,urad,\n", "line 2: unit"},
        {header + "EAX,0,0,um,\n", "line 2: unit"},
        {header + "C0Y,,0,um,\n", "line 2: unit"},
        {header + "EXX,0,0,,\n", "line 2: unit"},
        {header + "EXX,0,nan,um,\n", "line 2: value"},
        {header + "EXX,0,inf,um,\n", "line 2: value"},
        {header + "EXX,0,1e999,um,\n", "line 2: value"},
        {header + "EXX,0,,um,\n", "line 2: value"},
        {header + "EXX,0,\"1,5\",um,\n", "line 2: value"},
        {header + "EXX,,0,um,\n", "line 2: position_mm"},
        {header + "EXX,zero,0,um,\n", "line 2: position_mm"},
        {header + "EXX,0,0,um,-1\n", "line 2: standard_uncertainty"},
        {header + "EXX,0,0,um,x\n", "line 2: standard_uncertainty"},
        {header + "EXX,0,0,um,\nEXX,0,1,um,\n", "line 3: position_mm"},
        {header + "EXX,5,0,um,\nEXX,4,1,um,\n", "line 3: position_mm"},
        {header + "C0Y,0,0,urad,\n", "line 2: position_mm"},
        {header + "C0Y,,0,urad,\n\nC0Y,,1,urad,\n", "line 4: C0Y"},
        {header + "EXX,0,\"0,um,\n", "line 2"},
        {header + "EXX,0,0,um,\nEXX,10,1.", "line 3"},  // truncated
    };
    for (const auto& [text, culprit] : cases) {
        SCOPED_TRACE(text);
        expect_refused([&, &text = text] { parse_parameter_table(text, "t.csv"); }, "t.csv");
        expect_refused([&, &text = text] { parse_parameter_table(text, "t.csv"); }, culprit);
    }
}

TEST(ParameterTable, SpoiledTextIsReadOrRefused) {
    const std::string good = format_parameter_table(extreme_table());
    Spoiler spoil(4);
    int read = 0;
    for (int i = 0; i < 3000; ++i) {
        const std::string text = spoil(good);
        try {
            parse_parameter_table(text, "t.csv");
            ++read;
        } catch (const stepdiag::InvalidArgument& refusal) {
            EXPECT_EQ(std::string(refusal.what()).rfind("t.csv", 0), 0u) << refusal.what();
        }
    }
    EXPECT_GT(read, 0);  // some changes do no harm
}

TEST(ParameterTable, WhatIsNotFiniteIsNotWritten) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    ParameterTable table;
    table.functions[0] = FunctionTable{{0.0}, {nan}, {std::nullopt}};
    expect_refused([&] { format_parameter_table(table); }, "EXX");
    table.functions[0] = FunctionTable{{0.0}, {0.0}, {nan}};
    expect_refused([&] { format_parameter_table(table); }, "EXX");
}

TEST(ParameterTable, ColumnsMayStandInAnyOrder) {
    const auto table = parse_parameter_table(
        "unit,standard_uncertainty,value,parameter,position_mm\num,0.5,2.5,EXX,10\nurad,,-3,A0Z,\n", "t.csv");
    EXPECT_EQ(table.functions[0]->position, std::vector<double>{10.0});
    EXPECT_EQ(table.functions[0]->value, std::vector<double>{2.5e-3});
    EXPECT_EQ(table.functions[0]->standard_uncertainty[0], 0.5e-3);
    EXPECT_EQ(table.squarenesses[2]->value, -3e-6);
}

TEST(ParameterTable, OneDirectionOfEachParameterIsReadAsThatTable) {
    const std::string directed = "direction,parameter,position_mm,value,unit,standard_uncertainty\n";
    const auto table = parse_parameter_table(
        directed + "+,EXX,0,0,um,\n+,EXX,10,1,um,\n-,EYX,0,0,um,\n\u2212,EYX,10,2,um,\n,C0Y,,3,urad,\n", "t.csv");
    EXPECT_EQ(table.functions[0]->value, (std::vector<double>{0.0, 1e-3}));
    EXPECT_EQ(table.functions[1]->value, (std::vector<double>{0.0, 2e-3}));
    EXPECT_EQ(table.squarenesses[0]->value, 3e-6);
    for (const auto& function : table.negative_functions) EXPECT_FALSE(function);
    for (const auto& [rows, culprit] : std::vector<std::pair<std::string, std::string>>{
             {"+,EXX,0,0,um,\n-,EXX,0,0,um,\n+,EXX,0,0,um,\n", "line 4: position_mm: positions of EXX must ascend"},
             {"+,EXX,0,0,um,\n-,EXX,5,0,um,\n\u2212,EXX,5,0,um,\n", "line 4: position_mm: positions of EXX"},
             {"+,C0Y,,0,urad,\n\u2212,C0Y,,0,urad,\n", "line 3: C0Y is given twice"},
             {"+,EXX,0,0,um,\n,EXX,10,0,um,\n", "line 3: direction: expected + or - as in"},
             {",EXX,0,0,um,\n+,EXX,10,0,um,\n", "line 3: direction: expected an empty field"},
             {"forward,EXX,0,0,um,\n", "line 2: direction: expected + or -"}})
        expect_refused([&, &text = rows] { parse_parameter_table(directed + text, "t.csv"); }, culprit);
}

TEST(ParameterTable, BothDirectionsOfAFunctionAreReadInAnyOrder) {
    const auto table = parse_parameter_table(
        "parameter,position_mm,value,unit,standard_uncertainty,direction\nEXX,0,0,um,,+\nEXX,-1,3,um,0.5,-\n"
        "EXX,10,1,um,,+\nEXX,10,4,um,,\u2212\nEYX,0,7,um,,\n",
        "t.csv");
    EXPECT_EQ(table.functions[0]->position, (std::vector<double>{0.0, 10.0}));
    EXPECT_EQ(table.functions[0]->value, (std::vector<double>{0.0, 1e-3}));
    EXPECT_EQ(table.negative_functions[0]->position, (std::vector<double>{-1.0, 10.0}));
    EXPECT_EQ(table.negative_functions[0]->value, (std::vector<double>{3e-3, 4e-3}));
    EXPECT_EQ(table.negative_functions[0]->standard_uncertainty[0], 0.5e-3);
    EXPECT_EQ(format_parameter_table(table),
              "parameter,position_mm,value,unit,standard_uncertainty,direction\nEXX,0.0,0.0,um,,+\n"
              "EXX,10.0,1.0,um,,+\nEXX,-1.0,3.0,um,0.5,-\nEXX,10.0,4.0,um,,-\nEYX,0.0,7.0,um,,\n");
}

TEST(ParameterTable, DirectionIsWrittenOnlyWhereItMatters) {
    ParameterTable table;
    table.functions[0] = FunctionTable{{0.0}, {0.0}, {std::nullopt}};
    EXPECT_EQ(format_parameter_table(table), header + "EXX,0.0,0.0,um,\n");
    table.negative_functions[3] = table.functions[0];
    expect_refused([&] { format_parameter_table(table); }, "EAX: has a table of the - direction");
}

TEST(ParameterTable, FormatChainVolumeAndToolAreWrittenFirst) {
    ParameterTable table;
    table.header = {{"a", "1"},      {"chain", "c"},   {"format", stepdiag::calibration_format},
                    {"method", "m"}, {"tool_mm", "t"}, {"volume_mm", "v"}};
    const std::string text = format_parameter_table(table);
    EXPECT_EQ(text.substr(0, text.find("# sha256")),
              "# format=stepdiag calibration 1\n# chain=c\n# volume_mm=v\n# tool_mm=t\n# a=1\n# method=m\n");
}

// The two sums are those of `grep -v '^#' FILE | sha256sum`.
TEST(ParameterTable, ChecksumIsThatOfTheLinesBelowTheLeadingOnes) {
    ParameterTable table;
    table.header = {{"format", stepdiag::calibration_format}};
    EXPECT_EQ(format_parameter_table(table),
              "# format=stepdiag calibration 1\n"
              "# sha256=adf5583612d2fabd1fa2a6de1ff2662fc0bb57dd75f55cbf664e132b85fe3aaf\n" +
                  header);
    table.functions[0] = FunctionTable{{0.0, 1.0}, {0.0, 2.0}, {std::nullopt, std::nullopt}};
    EXPECT_EQ(format_parameter_table(table),
              "# format=stepdiag calibration 1\n"
              "# sha256=a0d21d8f00d714afab9477b9931b3ec704e146ea3071d3fb99e08ebe0a953558\n" +
                  header + "EXX,0.0,0.0,um,\nEXX,1.0,2000.0,um,\n");
}

TEST(ParameterTable, FileThatWasCutAnywhereInItsRowsIsRefused) {
    ParameterTable table;
    table.header = {{"format", stepdiag::calibration_format}};
    table.functions[0] = FunctionTable{{0.0, 1.0}, {0.0, 2.0}, {std::nullopt, 0.125}};
    const std::string text = format_parameter_table(table);
    EXPECT_EQ(parse_parameter_table(text, "t.csv").header, table.header);  // the sum is the file's, not the table's
    const std::string cut = text.substr(0, text.size() - 2);               // within its last number
    for (std::size_t size = text.find("EXX"); size < text.size(); ++size)
        EXPECT_THROW(parse_parameter_table(text.substr(0, size), "t.csv"), stepdiag::InvalidArgument) << size;
    expect_refused([&] { parse_parameter_table(cut, "t.csv"); }, "t.csv, line 2: sha256: expected \"");
}

TEST(ParameterTable, CalibrationWithoutItsChecksumIsUnverifiedAndSoAreItsCopies) {
    ParameterTable table;
    table.functions[0] = FunctionTable{{0.0, 1.0}, {0.0, 2.0}, {std::nullopt, std::nullopt}};
    for (const auto& own : std::vector<std::map<std::string, std::string>>{
             {{"format", stepdiag::calibration_format}}, {{"method", "adjustment"}}}) {  // before there was a format
        table.header = own;
        const std::string text = format_parameter_table(table);
        EXPECT_EQ(parse_parameter_table(text, "t.csv").header.count(stepdiag::unverified_key), 0u);
        const auto line = text.find("# sha256=");
        const std::string without = text.substr(0, line) + text.substr(text.find('\n', line) + 1);
        const ParameterTable read = parse_parameter_table(without, "t.csv");
        EXPECT_EQ(read.header.at(stepdiag::unverified_key), stepdiag::unverified_because);
        const std::string copy = format_parameter_table(read);
        EXPECT_NE(copy.find("# sha256="), std::string::npos);
        EXPECT_EQ(parse_parameter_table(copy, "t.csv").header.count(stepdiag::unverified_key), 1u);
        const std::string counted = "# rows=2\n" + without;  // a count is no checksum
        EXPECT_EQ(parse_parameter_table(counted, "t.csv").header.count(stepdiag::unverified_key), 1u);
    }
}

TEST(ParameterTable, ErrorMapNeedsNoChecksum) {
    for (const std::string leading :
         {"", "# chain=[w X' b Y Z t]\n", "# format=stepdiag error map 1\n# method=adjustment\n"})
        EXPECT_EQ(parse_parameter_table(leading + header + "EXX,0.0,0.0,um,\n", "t.csv")
                      .header.count(stepdiag::unverified_key),
                  0u);
}

TEST(ParameterTable, LineEndsDoNotChangeTheChecksum) {
    ParameterTable table;
    table.header = {{"format", stepdiag::calibration_format}};
    table.functions[0] = FunctionTable{{0.0, 1.0}, {0.0, 2.0}, {std::nullopt, std::nullopt}};
    const std::string text = format_parameter_table(table);
    std::string windows;
    for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
    EXPECT_EQ(parse_parameter_table(windows, "t.csv").functions[0]->value, table.functions[0]->value);
}

TEST(ParameterTable, FileOfAnEarlierVersionThatWasCutBetweenRowsIsRefused) {
    const std::string text = "# rows=2\n" + header + "EXX,0.0,0.0,um,\nEXX,1.0,2.0,um,\n";
    EXPECT_TRUE(parse_parameter_table(text, "t.csv").header.empty());  // the count is the file's, not the table's
    const std::string cut = text.substr(0, text.rfind("EXX"));
    expect_refused([&] { parse_parameter_table(cut, "t.csv"); }, "t.csv, line 1: rows: expected \"2\", got 1");
}

TEST(ParameterTable, HeaderThatCouldNotBeReadBackIsNotWritten) {
    for (const auto& [key, value] : std::vector<std::pair<std::string, std::string>>{
             {"note", "two\nlines"}, {"note", "carriage\rreturn"}, {"two\nlines", "x"}, {"note=1", "x"}}) {
        ParameterTable table;
        table.header[key] = value;
        expect_refused([&] { format_parameter_table(table); }, "header \"" + key);
    }
}
