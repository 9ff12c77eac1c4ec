#include "stepdiag/optics/medium.hpp"

#include <gtest/gtest.h>

#include "stepdiag/core/air.hpp"
#include "support/refuses.hpp"

namespace {

using namespace stepdiag;

// Dry air of 20 degrees Celsius and 101325 Pa at the d line: Ciddor 1996, as the NIST toolbox prints it for 633 nm,
// 2.4e-7 more here. Its square is in wavelength and index.
double air_of_catalogue(double wavelength) { return refractive_index(Air{20.0, 101325.0, 0.0, 450.0}, wavelength); }

// As data sheets have it: index relative to air, by the wavelength in air.
double in_air(const Glass& glass, double wavelength) {
    const double vacuum = wavelength * air_of_catalogue(wavelength);
    return refractive_index(glass, vacuum) / air_of_catalogue(vacuum);
}

TEST(GlassIndex, DataSheetsAreReproduced) {
    constexpr double d = 587.5618, F = 486.1327, C = 656.2725;  // nm in air
    constexpr double rounded = 0.6e-5;                          // five decimals
    struct {
        const char* name;
        double n_d, n_F, n_C, V_d;
    } const sheets[] = {{"N-BK7", 1.51680, 1.52238, 1.51432, 64.17},
                        {"F2", 1.62004, 1.63208, 1.61503, 36.37},
                        {"N-SF11", 1.78472, 1.80651, 1.77596, 25.68}};
    for (const auto& [name, n_d, n_F, n_C, V_d] : sheets) {
        const Glass& glass = find_glass(name);
        EXPECT_NEAR(in_air(glass, d), n_d, rounded) << name;
        EXPECT_NEAR(in_air(glass, F), n_F, rounded) << name;
        EXPECT_NEAR(in_air(glass, C), n_C, rounded) << name;
        EXPECT_NEAR((in_air(glass, d) - 1) / (in_air(glass, F) - in_air(glass, C)), V_d, 0.006) << name;
    }
    EXPECT_NEAR(in_air(find_glass("K7"), d), 1.51112, rounded);
    EXPECT_NEAR(in_air(find_glass("N-SK4"), d), 1.61272, rounded);
    EXPECT_NEAR(in_air(find_glass("fused silica"), d), 1.45846, rounded);  // Malitson's table
    EXPECT_NEAR(in_air(find_glass("N-BK7"), 632.8), 1.515089, 0.6e-6);
    EXPECT_NEAR(in_air(find_glass("N-BK7"), 1530.0), 1.500902, 0.6e-6);
}

TEST(GlassIndex, UnknownGlassAndWavelengthAreRefused) {
    expect_refused([] { find_glass("BK7"); }, "N-BK7");
    expect_refused([] { refractive_index(find_glass("N-BK7"), 200.0); }, "wavelength");
}

}  // namespace
