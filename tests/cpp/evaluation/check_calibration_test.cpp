#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "stepdiag/evaluation/calibration.hpp"
#include "support/refuses.hpp"

namespace {

using stepdiag::Calibration;

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
