// What light travels through: a constant index, optical glass (air: core/air.hpp). Wavelengths are vacuum wavelengths
// in nm.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace stepdiag {

// A medium of constant refractive index, as a trace at one wavelength sees it.
struct Medium {
    double index = 1.0;
};

// Optical glass by its Sellmeier equation, n^2 - 1 = sum B_i L / (L - C_i) with L = (wavelength/um)^2.
struct Glass {
    std::string name;
    double B[3];
    double C[3];  // um^2
};

// SCHOTT's N-BK7, K7, N-SK4, F2 and N-SF11 (catalogue constants, relative to air of 20 degrees Celsius and 101325 Pa,
// as catalogues are) and fused silica (I. H. Malitson, J. Opt. Soc. Am. 55 (1965) 1205).
const std::vector<Glass>& glasses();
const Glass& find_glass(std::string_view name);  // throws InvalidArgument naming those there are

// At 334 to 2325 nm, where all these constants hold. Throws InvalidArgument outside.
double refractive_index(const Glass& glass, double wavelength);

}  // namespace stepdiag
