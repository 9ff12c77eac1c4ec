// Optical media: a constant refractive index, and optical glass by its Sellmeier equation. Air is in core/air.hpp.
// Wavelengths are vacuum wavelengths in nm.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace stepdiag {

// A medium of constant refractive index, for a trace at one wavelength.
struct Medium {
    double index = 1.0;
};

// Optical glass with the Sellmeier equation n^2 - 1 = sum B_i L / (L - C_i), L = (wavelength/um)^2. Index and
// wavelength are those in the air of the catalogue: dry, 20 degrees Celsius, 101325 Pa.
struct Glass {
    std::string name;
    double B[3];
    double C[3];  // um^2
};

// SCHOTT's N-BK7, K7, N-SK4, F2 and N-SF11 with the constants of the catalogue, and fused silica (I. H. Malitson, J.
// Opt. Soc. Am. 55 (1965) 1205).
const std::vector<Glass>& glasses();
// Throws InvalidArgument, which lists the known glasses, for an unknown name.
const Glass& find_glass(std::string_view name);

// Absolute, for a vacuum wavelength in nm. Throws InvalidArgument for a wavelength outside 334 to 2325 nm, the range in
// which the constants of all glasses are valid.
double refractive_index(const Glass& glass, double wavelength);

}  // namespace stepdiag
