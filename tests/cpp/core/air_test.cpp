#include "stepdiag/core/air.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/refuses.hpp"

namespace {

using namespace stepdiag;

struct AirValue {
    double temperature, relative_humidity, pressure, wavelength, ciddor, modified_edlen;
};

// NIST Engineering Metrology Toolbox, refractive index of air calculator.
constexpr AirValue published[] = {
    {20, 0.00, 101325, 633, 1.000271800, 1.000271799},  {20, 0.00, 60000, 633, 1.000160924, 1.000160920},
    {20, 0.00, 120000, 633, 1.000321916, 1.000321918},  {50, 0.00, 100000, 633, 1.000243285, 1.000243270},
    {5, 0.00, 100000, 633, 1.000282756, 1.000282750},   {-40, 0.00, 100000, 633, 1.000337580, 1.000337471},
    {50, 1.00, 120000, 633, 1.000287924, 1.000287864},  {40, 0.75, 120000, 633, 1.000299418, 1.000299406},
    {20, 1.00, 100000, 633, 1.000267394, 1.000267394},  {40, 1.00, 110000, 1700, 1.000270247, 1.000270237},
    {20, 0.00, 101325, 1700, 1.000268479, 1.000268483}, {20, 0.00, 101325, 300, 1.000286581, 1.000286579},
};

TEST(AirIndex, PublishedValuesAreReproduced) {
    // The published values are rounded to nine decimals.
    for (const AirValue& v : published) {
        const Air air{v.temperature, v.pressure, v.relative_humidity, 450.0};
        EXPECT_NEAR(refractive_index(air, v.wavelength, AirEquation::ciddor), v.ciddor, 0.6e-9) << v.temperature;
        EXPECT_NEAR(refractive_index(air, v.wavelength, AirEquation::modified_edlen), v.modified_edlen, 0.6e-9)
            << v.temperature;
    }
}

TEST(AirIndex, SensitivitiesAtTheHeadsWavelengthAreTheKnownOnes) {
    const auto index = [](double t, double p, double h) { return refractive_index(Air{t, p, h, 450.0}, 1530.0); };
    EXPECT_NEAR(index(20, 101325, 0.5), 1.000268164, 0.6e-9);
    // Known to the last digit that is given: -0.94 ppm/K, +0.265 ppm/hPa, -0.009 ppm/%RH.
    EXPECT_NEAR((index(20.5, 101325, 0.5) - index(19.5, 101325, 0.5)) * 1e6, -0.94, 0.005);
    EXPECT_NEAR(index(20, 101375, 0.5) * 1e6 - index(20, 101275, 0.5) * 1e6, 0.265, 0.0005);
    EXPECT_NEAR(index(20, 101325, 0.505) * 1e6 - index(20, 101325, 0.495) * 1e6, -0.009, 0.0005);
}

// Recomputed from the published constants with 40 digits (mpmath).
TEST(AirIndex, EdlenOf1966HasItsOwnDensityAndWater) {
    const auto index = [](double t, double humidity, double wavelength) {
        return refractive_index(Air{t, 101325.0, humidity, 450.0}, wavelength, AirEquation::edlen_1966);
    };
    EXPECT_NEAR(index(20.0, 0.5, 633.0), 1.000271295519, 1e-12);
    EXPECT_NEAR(index(30.0, 0.8, 633.0), 1.000261366444, 1e-12);
    EXPECT_NEAR(index(20.0, 0.5, 1530.0), 1.000268094079, 1e-12);
}

TEST(AirIndex, EdlenOf1966IsItsDispersionInStandardAir) {
    // Standard air is dry, 15 degrees Celsius, 760 torr; the constants of the density make that 1 to 4e-7 of 2.8e-4.
    const double S = 1e6 / (633.0 * 633.0), standard = 1e-8 * (8342.13 + 2406030.0 / (130 - S) + 15997.0 / (38.9 - S));
    EXPECT_NEAR(refractive_index(Air{15.0, 101325.0, 0.0, 300.0}, 633.0, AirEquation::edlen_1966), 1.0 + standard,
                2e-10);
}

TEST(AirIndex, WhatIsOutOfRangeIsRefusedByName) {
    expect_refused([] { refractive_index(Air{200.0}, 633.0); }, "temperature");
    expect_refused([] { refractive_index(Air{20.0, 101.325}, 633.0); }, "pressure");
    expect_refused([] { refractive_index(Air{20.0, 101325.0, 50.0}, 633.0); }, "relative_humidity");
    expect_refused([] { refractive_index(Air{20.0, 101325.0, 0.5, -1.0}, 633.0); }, "carbon_dioxide");
    expect_refused([] { refractive_index(Air{}, 0.633); }, "wavelength");
    expect_refused([] { refractive_index(Air{}, std::nan("")); }, "wavelength");
    expect_refused([] { parse_air_equation("edlen"); }, "air equation");
}

}  // namespace
