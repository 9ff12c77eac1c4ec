#include "stepdiag/optics/medium.hpp"

#include <gtest/gtest.h>

#include "support/refuses.hpp"

namespace {

using namespace stepdiag;

TEST(GlassIndex, CatalogueValuesAreReproduced) {
    struct {
        const char* name;
        double n_d, V_d;
    } const catalogue[] = {{"N-BK7", 1.51680, 64.17},
                           {"K7", 1.51112, 60.41},
                           {"N-SK4", 1.61272, 58.63},
                           {"F2", 1.62004, 36.37},
                           {"N-SF11", 1.78472, 25.68}};
    for (const auto& [name, n_d, V_d] : catalogue) {
        const Glass& glass = find_glass(name);
        const auto n = [&](double wavelength) { return refractive_index(glass, wavelength); };
        EXPECT_NEAR(n(587.5618), n_d, 0.6e-5) << name;  // rounded to five decimals
        EXPECT_NEAR((n(587.5618) - 1) / (n(486.1327) - n(656.2725)), V_d, 0.006) << name;
    }
    EXPECT_NEAR(refractive_index(find_glass("N-BK7"), 632.8), 1.515089, 0.6e-6);
    EXPECT_NEAR(refractive_index(find_glass("N-BK7"), 1530.0), 1.500902, 0.6e-6);
    EXPECT_NEAR(refractive_index(find_glass("fused silica"), 587.5618), 1.45846, 0.6e-5);  // Malitson's table
}

TEST(GlassIndex, UnknownGlassAndWavelengthAreRefused) {
    expect_refused([] { find_glass("BK7"); }, "N-BK7");
    expect_refused([] { refractive_index(find_glass("N-BK7"), 200.0); }, "wavelength");
}

}  // namespace
