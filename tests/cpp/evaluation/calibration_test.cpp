#include "stepdiag/evaluation/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "support/refuses.hpp"

namespace {

using stepdiag::Calibration;

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

Calibration sample() {
    Calibration calibration{
        "enhanced", stepdiag::Chain::parse("[w Y' b X Z t]"), {800.0, 1.0 / 3.0, 1e3}, {-0.1, 0.0, 1e-7}, {}, {}, {},
        {}};
    calibration.functions[0] =
        stepdiag::CalibratedFunction{{0.0, 1.0 / 3.0, 800.0}, {-0.0, 5e-324, 1e300}, {0.0, 1e-300, 0.1}, false};
    calibration.functions[17] = stepdiag::CalibratedFunction{{0.0, 500.0}, {0.0, 1.0 / 7.0 * 1e-6}, {0.0, 3e-7}, true};
    calibration.squarenesses[1] = stepdiag::CalibratedSquareness{-1e-5 / 3.0, 1e-6 / 3.0};
    calibration.date = "2026-11-21T12:00:00Z";
    calibration.undetermined = {"slope of EXX: add the scale line p00", "C0Y: \"add\" body diagonals, or faces"};
    return calibration;
}

const std::filesystem::path folder = std::filesystem::temp_directory_path();

void expect_file_refused(const std::string& text, const std::string& culprit) {
    const auto path = (folder / "stepdiag_bad_calibration.csv").string();
    std::ofstream(path, std::ios::binary) << text;
    expect_refused([&] { stepdiag::read_calibration(path); }, path);
    expect_refused([&] { stepdiag::read_calibration(path); }, culprit);
    std::filesystem::remove(path);
}

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

// Three values: EXX at two nodes, and C0Y.
Calibration sound() {
    Calibration calibration{
        "by hand", stepdiag::Chain::parse("[w b X Y Z t]"), {800.0, 600.0, 500.0}, {0.0, 0.0, 0.0}, {}, {}, {}, {}};
    calibration.functions[0] = stepdiag::CalibratedFunction{{0.0, 800.0}, {0.0, 0.01}, {0.0, 2.0}};
    calibration.squarenesses[0] = stepdiag::CalibratedSquareness{1e-5, 3.0};
    calibration.reversal[0] = stepdiag::CalibratedReversal{{0.0, 800.0}, {0.0, 0.01}, {0.0, unknown}, {unknown, 1.0}};
    calibration.covariance.setZero(3, 3);
    calibration.covariance(1, 1) = 4.0;
    calibration.covariance(2, 2) = 9.0;
    calibration.covariance(1, 2) = calibration.covariance(2, 1) = -6.0;  // fully correlated is allowed
    return calibration;
}

void expect_spoiled(const std::function<void(Calibration&)>& spoil, const std::string& culprit) {
    Calibration calibration = sound();
    spoil(calibration);
    expect_refused([&] { check(calibration); }, culprit);
}

}  // namespace

TEST(Calibration, FileIsReadBackToTheSameBits) {
    const auto path = (folder / "stepdiag_calibration_test.csv").string();
    Calibration a = sample();
    a.fit_codes = {"misfit", "trend"};
    write_calibration(a, path);
    const Calibration b = stepdiag::read_calibration(path);
    EXPECT_EQ(b.method, a.method);
    EXPECT_EQ(b.date, a.date);
    EXPECT_EQ(b.chain, a.chain);
    EXPECT_EQ(b.volume, a.volume);
    EXPECT_EQ(b.tool, a.tool);
    EXPECT_EQ(b.undetermined, a.undetermined);
    EXPECT_EQ(b.fit_codes, a.fit_codes);
    for (int i = 0; i < stepdiag::function_count; ++i) {
        ASSERT_EQ(b.functions[i].has_value(), a.functions[i].has_value()) << i;
        if (!a.functions[i]) continue;
        EXPECT_TRUE(same_bits(a.functions[i]->position, b.functions[i]->position));
        EXPECT_TRUE(same_bits(a.functions[i]->value, b.functions[i]->value));
        EXPECT_TRUE(same_bits(a.functions[i]->standard_uncertainty, b.functions[i]->standard_uncertainty));
        EXPECT_EQ(b.functions[i]->slope_determined, a.functions[i]->slope_determined);
    }
    for (int s = 0; s < stepdiag::squareness_count; ++s) {
        ASSERT_EQ(b.squarenesses[s].has_value(), a.squarenesses[s].has_value());
        if (a.squarenesses[s]) {
            EXPECT_EQ(b.squarenesses[s]->value, a.squarenesses[s]->value);
            EXPECT_EQ(b.squarenesses[s]->standard_uncertainty, a.squarenesses[s]->standard_uncertainty);
        }
    }
    std::filesystem::remove(path);
}

TEST(Calibration, ReversalErrorsAreWrittenAsFunctionsOfTheOtherDirection) {
    const auto path = (folder / "stepdiag_calibration_reversal_test.csv").string();
    Calibration a = sample();
    // At the function's nodes, at some of them, and between them; sums of these halves and quarters are exact.
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    a.functions[3] = stepdiag::CalibratedFunction{{0.0, 400.0, 800.0}, {0.0, 0.5, 0.25}, {0.0, 0.1, 0.2}};
    a.reversal[3] =
        stepdiag::CalibratedReversal{{0.0, 400.0, 800.0}, {0.75, 0.5, -1.0}, {0.1, 0.2, 0.3}, {0.4, 0.5, nan}};
    a.reversal[17] = stepdiag::CalibratedReversal{{0.0}, {2.0}, {0.1}, {0.2}};
    a.functions[6] = stepdiag::CalibratedFunction{{0.0, 400.0}, {0.0, 1.0}, {0.0, 0.1}};
    a.reversal[6] = stepdiag::CalibratedReversal{{0.0, 200.0}, {0.0, 2.0}, {0.0, 0.1}, {0.3, 0.2}, false};
    a.reversal[7] = a.reversal[6];  // of a function that is not determined: a table has no place for it
    write_calibration(a, path);
    const Calibration b = stepdiag::read_calibration(path);
    const auto map = stepdiag::read_error_map(path);
    EXPECT_EQ(map.function(stepdiag::FunctionId::at(3), 800.0), 0.25);
    EXPECT_EQ(map.function(stepdiag::FunctionId::at(3), 800.0, stepdiag::Approach::negative), 1.25);
    EXPECT_EQ(map.function(stepdiag::FunctionId::at(6), 200.0, stepdiag::Approach::negative), -1.5);
    for (int i = 0; i < stepdiag::function_count; ++i) {
        SCOPED_TRACE(i);
        ASSERT_EQ(b.reversal[i].has_value(), i == 3 || i == 6 || i == 17);
        if (!b.reversal[i]) continue;
        EXPECT_TRUE(same_bits(b.reversal[i]->position, a.reversal[i]->position));
        EXPECT_EQ(b.reversal[i]->value, a.reversal[i]->value);
        EXPECT_EQ(b.reversal[i]->constant_determined, a.reversal[i]->constant_determined);
        ASSERT_EQ(b.reversal[i]->standard_uncertainty.size(), a.reversal[i]->position.size());
        for (const double u : b.reversal[i]->standard_uncertainty) EXPECT_TRUE(std::isnan(u));
        EXPECT_TRUE(
            same_bits(b.reversal[i]->negative_standard_uncertainty, a.reversal[i]->negative_standard_uncertainty));
    }
    write_calibration(b, path);
    EXPECT_EQ(stepdiag::read_calibration(path).reversal[3]->value, a.reversal[3]->value);
    std::filesystem::remove(path);
}

TEST(Calibration, FileIsAnErrorMapToo) {
    const auto path = (folder / "stepdiag_calibration_as_map_test.csv").string();
    write_calibration(sample(), path);
    const auto map = stepdiag::read_error_map(path);
    EXPECT_EQ(map.squareness(stepdiag::Squareness::B0Z), -1e-5 / 3.0);
    EXPECT_EQ(map.function(stepdiag::FunctionId::at(17), 500.0), 1.0 / 7.0 * 1e-6);
    EXPECT_EQ(map.function(stepdiag::FunctionId::at(3), 500.0), 0.0);  // undetermined is 0 in a map
    std::filesystem::remove(path);
}

TEST(Calibration, HeaderThatMakesNoSenseIsRefused) {
    const std::string table = "parameter,position_mm,value,unit,standard_uncertainty\nEXX,0,0,um,\n";
    const std::string chain = "# chain=[w X' b Y Z t]\n", size = "# volume_mm=800 600 500\n",
                      tool = "# tool_mm=0 0 0\n";
    expect_file_refused(table, "chain");
    expect_file_refused(size + tool + table, "chain");
    expect_file_refused(chain + tool + table, "volume_mm");
    expect_file_refused(chain + size + table, "tool_mm");
    expect_file_refused("# chain=[w X b Y Z t]\n" + size + tool + table, "chain");
    expect_file_refused(chain + "# volume_mm=800 600\n" + tool + table, "volume_mm");
    expect_file_refused(chain + "# volume_mm=800 600 x\n" + tool + table, "volume_mm");
    expect_file_refused(chain + "# volume_mm=800 0 500\n" + tool + table, "volume_mm");
    expect_file_refused(chain + size + "# tool_mm=0 inf 0\n" + table, "tool_mm");
    expect_file_refused(chain + size + tool + "# undetermined_slopes=EXQ\n" + table, "EXQ");
    expect_file_refused(chain + size + tool + "# undetermined_reversal_constants=C0Y\n" + table, "C0Y");
}
TEST(CheckCalibration, SoundOnePasses) {
    EXPECT_NO_THROW(check(sound()));
    Calibration open = sound();
    open.functions[0]->standard_uncertainty = {unknown, unknown};
    open.squarenesses[0]->standard_uncertainty = unknown;
    EXPECT_NO_THROW(check(open));
}

TEST(CheckCalibration, PartsThatDoNotFitAreRefused) {
    expect_spoiled([](Calibration& c) { c.volume[1] = 0.0; }, "volume");
    expect_spoiled([](Calibration& c) { c.tool[1] = infinite; }, "tool");
    expect_spoiled([](Calibration& c) { c.date = "today\n"; }, "date");
    expect_spoiled([](Calibration& c) { c.undetermined = {"all\r"}; }, "undetermined");
    expect_spoiled([](Calibration& c) { c.fit_codes = {"no misfit"}; }, "fit_codes");
    expect_spoiled(
        [](Calibration& c) {
            c.fit_codes = {"misfit", "trend"};
            c.fit_reasons = {"one"};
        },
        "fit_codes");
    expect_spoiled([](Calibration& c) { c.functions[0]->value.pop_back(); }, "EXX");
    expect_spoiled([](Calibration& c) { c.functions[0] = stepdiag::CalibratedFunction{}; }, "EXX");
    expect_spoiled([](Calibration& c) { c.functions[0]->position = {0.0, 0.0}; }, "EXX");
    expect_spoiled([](Calibration& c) { c.functions[0]->value[1] = unknown; }, "EXX");
    expect_spoiled([](Calibration& c) { c.functions[0]->standard_uncertainty[1] = -2.0; }, "EXX");
    expect_spoiled([](Calibration& c) { c.squarenesses[0]->value = infinite; }, "C0Y");
    expect_spoiled([](Calibration& c) { c.squarenesses[0]->standard_uncertainty = -3.0; }, "C0Y");
    expect_spoiled([](Calibration& c) { c.reversal[0]->value.clear(); }, "reversal of EXX");
    expect_spoiled([](Calibration& c) { c.reversal[0]->negative_standard_uncertainty.clear(); }, "reversal of EXX");
    expect_spoiled([](Calibration& c) { c.reversal[0]->position = {8.0, 0.0}; }, "ascend");
    expect_spoiled([](Calibration& c) { c.reversal[0]->negative_standard_uncertainty[1] = -1.0; }, "reversal of EXX");
}

TEST(CheckCalibration, MatrixThatIsNoCovarianceOfTheseValuesIsRefused) {
    expect_spoiled([](Calibration& c) { c.covariance.setZero(2, 2); }, "covariance: expected 3 rows");
    expect_spoiled([](Calibration& c) { c.covariance(1, 1) = 4.1; }, "square of the standard uncertainty");
    expect_spoiled([](Calibration& c) { c.covariance(0, 0) = unknown; }, "row 0, column 0");
    expect_spoiled([](Calibration& c) { c.covariance(1, 2) = -5.0; }, "symmetric");
    expect_spoiled([](Calibration& c) { c.covariance(0, 2) = 1e-9; }, "at most the product");
    expect_spoiled([](Calibration& c) { c.covariance(1, 2) = unknown; }, "covariance of EXX and C0Y");
}
