// The refractive index of air. Wavelengths are vacuum wavelengths in nm.
#pragma once

#include <string_view>
#include <variant>

namespace stepdiag {

// State of the air. Carbon dioxide counts for Ciddor only.
struct Air {
    double temperature = 20.0;       // degrees Celsius, -40 to 100
    double pressure = 101325.0;      // Pa, 10 000 to 140 000
    double relative_humidity = 0.5;  // 0 to 1
    double carbon_dioxide = 450.0;   // ppm by volume, 0 to 2000
};

enum class AirEquation {
    ciddor,          // P. E. Ciddor, Appl. Opt. 35 (1996) 1566, with the IAPWS vapour pressure
    modified_edlen,  // K. P. Birch, M. J. Downs, Metrologia 30 (1993) 155 and 31 (1994) 315, water term as NIST gives
                     // it
    edlen_1966,      // B. Edlen, Metrologia 2 (1966) 71: the dispersion of that paper, density and water as above
};

AirEquation parse_air_equation(std::string_view text);  // "ciddor", "modified_edlen", "edlen_1966"

// Phase refractive index at 300 to 1700 nm. Throws InvalidArgument outside the ranges above.
double refractive_index(const Air& air, double wavelength, AirEquation equation = AirEquation::ciddor);

// The air around machine and head: a constant index at every wavelength, or a state of the air.
struct Environment {
    std::variant<double, Air> air = 1.0;
    AirEquation equation = AirEquation::ciddor;
    double relative_error = 0.0;  // the index is 1 + this times what the constant or the equation says
};
double refractive_index(const Environment& environment, double wavelength);

}  // namespace stepdiag
