#include "core/text_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

#include "stepdiag/version.hpp"
#include "support/refuses.hpp"

namespace {

using stepdiag::format_decimal;
using stepdiag::parse_csv;
using stepdiag::parse_decimal;

std::uint64_t bits(double value) {
    std::uint64_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
}

// Numbers of every kind: any bit pattern, and the sizes that errors of machines have.
std::vector<double> many_doubles() {
    using limits = std::numeric_limits<double>;
    std::vector<double> values = {0.0,           -0.0,
                                  1.0,           0.1,
                                  -2.5e-6,       1e-300,
                                  1e300,         5e-324,
                                  limits::min(), limits::denorm_min() * 12345,
                                  limits::max(), std::nextafter(1.0, 2.0),
                                  1.0 / 3.0,     9007199254740993.0,
                                  123456.0,      1e15,
                                  1e16,          1e-5};
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> mantissa(-1.0, 1.0), exponent(-20.0, 20.0);
    while (values.size() < 20'000) {
        const std::uint64_t word = engine();
        double value;
        std::memcpy(&value, &word, sizeof value);
        if (std::isfinite(value)) values.push_back(value);
        values.push_back(mantissa(engine) * std::pow(10.0, exponent(engine)));
    }
    return values;
}

}  // namespace

TEST(Decimal, ShiftedNumberIsReadBackToTheSameBits) {
    for (const double value : many_doubles())
        for (const int shift : {0, 3, 6}) {
            const std::string text = format_decimal(value, shift);
            const auto back = parse_decimal(text, -shift);
            ASSERT_TRUE(back) << text;
            ASSERT_EQ(bits(*back), bits(value)) << text << " shifted by " << shift;
        }
}

TEST(Decimal, ShiftIsExactWhereAMultiplicationWouldRoundTwice) {
    // strtod of the text with its exponent written out is correctly rounded: the only right answer.
    int differs = 0;
    for (int i = 1; i < 2000; ++i) {
        const std::string digits = std::to_string(i * 0.7919);
        const double expected = std::strtod((digits + "e-6").c_str(), nullptr);
        EXPECT_EQ(bits(*parse_decimal(digits, -6)), bits(expected)) << digits;
        differs += std::strtod(digits.c_str(), nullptr) * 1e-6 != expected;
    }
    EXPECT_GT(differs, 0);  // the test can distinguish the two
}

TEST(Decimal, ShortestTextIsWritten) {
    EXPECT_EQ(format_decimal(2.5e-6, 6), "2.5");
    EXPECT_EQ(format_decimal(0.1, 0), "0.1");
    EXPECT_EQ(format_decimal(-0.0, 6), "-0.0");
    EXPECT_EQ(format_decimal(800.0, 0), "800.0");
}

TEST(Decimal, EveryPlainNotationIsRead) {
    EXPECT_EQ(parse_decimal("2.5", -6), 2.5e-6);
    EXPECT_EQ(parse_decimal("+2.5e+1", 0), 25.0);
    EXPECT_EQ(parse_decimal("-25E-1", 3), -2500.0);
    EXPECT_EQ(parse_decimal(".5", 0), 0.5);
    EXPECT_EQ(parse_decimal("5.", 0), 5.0);
    EXPECT_EQ(parse_decimal("007", 0), 7.0);
}

TEST(Decimal, WhatIsNoFiniteNumberIsNone) {
    for (const char* text : {"",    "inf",   "-inf",  "nan", "NaN",   "infinity", "1e999", "-1e999",
                             "1,5", "1.5.2", "0x10",  "1e",  "e5",    ".",        "-",     "+",
                             "--1", "+-1",   "-+1",   "1 2", " 1",    "1e5.5",    "1e+-5", "1e99999999999999999999",
                             "1d5", "1_000", "1'000", "½",   "1e1e1", "1-",       "1+1"})
        EXPECT_EQ(parse_decimal(text, 0), std::nullopt) << '"' << text << '"';
}

TEST(Decimal, LongNumbersAreNotMistaken) {
    EXPECT_EQ(parse_decimal(std::string(400, '9') + "e-1", 0),
              std::nullopt);  // 1e399: too large, whatever its exponent says
    EXPECT_EQ(parse_decimal("1" + std::string(400, '0') + "e-400", 0), 1.0);  // long, but 1
    EXPECT_EQ(parse_decimal("0." + std::string(400, '0') + "1", 0), 0.0);     // too small for a double is 0
    EXPECT_EQ(parse_decimal("1e-400", 0), 0.0);
    EXPECT_EQ(parse_decimal("1e-2147483648", -6).value_or(0.0), 0.0);  // refused or 0, but no overflow of the exponent
    EXPECT_EQ(parse_decimal("1e2147483647", 6), std::nullopt);
}

TEST(Csv, FieldsQuotesAndLineEndsOfRfc4180AreRead) {
    const auto file = parse_csv("\xEF\xBB\xBF# a=1\r\n#b\r\nx,y\r\n1,\"two, \"\"2\"\"\"\r\n\r\n,\n3,4", "run.csv");
    ASSERT_EQ(file.comments.size(), 2u);
    EXPECT_EQ(file.comments[0].fields[0], " a=1");
    EXPECT_EQ(file.header.fields, (std::vector<std::string>{"x", "y"}));
    ASSERT_EQ(file.rows.size(), 3u);
    EXPECT_EQ(file.rows[0].fields[1], "two, \"2\"");
    EXPECT_EQ(file.rows[1].fields, (std::vector<std::string>{"", ""}));
    EXPECT_EQ(file.rows[2].line, 7);
}

TEST(Csv, BrokenRecordsAreRefusedWithTheirLine) {
    expect_refused([] { parse_csv("", "run.csv"); }, "run.csv");
    expect_refused([] { parse_csv("# only=remarks\n\n", "run.csv"); }, "run.csv");
    expect_refused([] { parse_csv("a,b\n1\n", "run.csv"); }, "run.csv, line 2");
    expect_refused([] { parse_csv("a,b\n1,2\n1,2,3\n", "run.csv"); }, "run.csv, line 3");
    expect_refused([] { parse_csv("a,b\n\"1,2\n", "run.csv"); }, "run.csv, line 2");
    expect_refused([] { parse_csv("a,b\n1\"2\",3\n", "run.csv"); }, "run.csv, line 2");
    expect_refused([] { parse_csv("a,\"b\n", "run.csv"); }, "run.csv, line 1");
    expect_refused([] { parse_csv("a,b\n1,\"2\"3\n", "run.csv"); }, "run.csv, line 2");
}

TEST(TextFile, WhatCannotBeReadIsRefusedByName) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_test";
    fs::create_directories(folder);
    const auto write = [&](const char* name, const std::string& text) {
        std::ofstream(folder / name, std::ios::binary) << text;
        return (folder / name).string();
    };
    expect_refused([&] { stepdiag::read_text_file((folder / "absent.csv").string()); }, "absent.csv");
    expect_refused([&] { stepdiag::read_text_file(folder.string()); }, "folder");
    const auto empty = write("empty.csv", "");
    expect_refused([&] { stepdiag::read_text_file(empty); }, "empty.csv");
    const auto binary = write("binary.csv", std::string("a,b\n\0\x7f", 6));
    expect_refused([&] { stepdiag::read_text_file(binary); }, "binary");
    expect_refused([&] { stepdiag::read_text_file(std::string(5000, 'x')); }, "cannot be read");
    expect_refused([&] { stepdiag::write_text_file((folder / "no" / "such.csv").string(), "x"); }, "such.csv");
    expect_refused([&] { stepdiag::write_text_file(folder.string(), "x"); }, folder.string());
    expect_refused([&] { stepdiag::write_text_file("", "x"); }, "cannot be");
    fs::remove_all(folder);
}

TEST(TextFile, WritingReplacesTheWholeFileAndLeavesNothingElse) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_write_test";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::string path = (folder / "a.csv").string();
    stepdiag::write_text_file(path, "a long first text\n");
    stepdiag::write_text_file(path, "short\n");
    EXPECT_EQ(stepdiag::read_text_file(path), "short\n");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
    fs::remove_all(folder);
}

TEST(TextFile, ModeOfAnExistingFileIsKeptAndANewOneHasThatOfAnyNewFile) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_mode_test";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const fs::path plain = folder / "plain", file = folder / "a.csv";
    std::ofstream(plain) << "x";
    stepdiag::write_text_file(file.string(), "first");
    EXPECT_EQ(fs::status(file).permissions(), fs::status(plain).permissions());
    const auto own = fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read;
    fs::permissions(file, own);
    const bool has_modes = fs::status(file).permissions() == own;
    stepdiag::write_text_file(file.string(), "second");
    if (has_modes) {
        EXPECT_EQ(fs::status(file).permissions(), own);
    }
    fs::remove_all(folder);
    if (!has_modes) GTEST_SKIP() << "files have no modes on this system";
}

TEST(TextFile, ReadOnlyFileIsNotReplaced) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_read_only_test";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::string path = (folder / "a.csv").string();
    stepdiag::write_text_file(path, "first");
    fs::permissions(path, fs::perms::owner_read);
    expect_refused([&] { stepdiag::write_text_file(path, "second"); }, "the file is read-only");
    EXPECT_EQ(stepdiag::read_text_file(path), "first");
    fs::permissions(path, fs::perms::owner_all);  // Windows removes no read-only file
    fs::remove_all(folder);
}

TEST(TextFile, FileBehindALinkIsWrittenEvenWhereItIsNotThereYet) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_link_test";
    fs::remove_all(folder);
    fs::create_directories(folder / "deep");
    fs::create_symlink("deep/second", folder / "first");
    fs::create_symlink("target.csv", folder / "deep" / "second");
    fs::create_symlink("no/such/folder", folder / "astray");
    fs::create_symlink("circle", folder / "circle");
    if (!fs::is_symlink(folder / "first")) {
        fs::remove_all(folder);
        GTEST_SKIP() << "this system makes no symbolic links";
    }
    for (const char* text : {"new", "changed"}) {
        stepdiag::write_text_file((folder / "first").string(), text);
        EXPECT_TRUE(fs::is_symlink(folder / "first") && fs::is_symlink(folder / "deep" / "second"));
        EXPECT_EQ(stepdiag::read_text_file((folder / "deep" / "target.csv").string()), text);
    }
    expect_refused([&] { stepdiag::write_text_file((folder / "astray").string(), "x"); }, "astray: cannot be written");
    expect_refused([&] { stepdiag::write_text_file((folder / "circle").string(), "x"); }, "circle: cannot be written");
    EXPECT_TRUE(fs::is_symlink(folder / "circle"));
    fs::remove_all(folder);
}

TEST(TextFile, ManyThreadsWritingOneFileLeaveOneWholeText) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "stepdiag_text_file_thread_test";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::string path = (folder / "a.csv").string();
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < 20; ++i) stepdiag::write_text_file(path, std::string(10'000, char('a' + t)));
        });
    for (auto& thread : threads) thread.join();
    const std::string text = stepdiag::read_text_file(path);
    EXPECT_EQ(text, std::string(10'000, text[0]));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
    fs::remove_all(folder);
}

TEST(NewerFormat, IsALargerNumberBehindTheSameName) {
    for (const auto& [expected, given] : std::vector<std::pair<const char*, const char*>>{
             {"1", "2"}, {"9", "10"}, {"stepdiag calibration 1", "stepdiag calibration 2"}, {"1", "0020"}})
        EXPECT_EQ(stepdiag::newer_format(expected, given),
                  ": it is for a newer stepdiag than " STEPDIAG_VERSION "; install that one");
    for (const auto& [expected, given] : std::vector<std::pair<const char*, const char*>>{
             {"1", "1"}, {"10", "9"}, {"1", "01"}, {"1", ""}, {"1", "0"}, {"1", "-2"}, {"a 1", "b 2"}, {"a 1", "a"}})
        EXPECT_EQ(stepdiag::newer_format(expected, given), "") << given;
}
