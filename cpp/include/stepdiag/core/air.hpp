// The phase refractive index of air from its temperature, pressure, humidity and carbon dioxide. Wavelengths are vacuum
// wavelengths in nm.
#pragma once

#include <string_view>
#include <variant>

namespace stepdiag {

// State of the air. Only Ciddor's equation uses the carbon dioxide content.
struct Air {
    double temperature = 20.0;       // degrees Celsius, -40 to 100
    double pressure = 101325.0;      // Pa, 10 000 to 140 000
    double relative_humidity = 0.5;  // 0 to 1
    double carbon_dioxide = 450.0;   // ppm by volume, 0 to 2000
};

enum class AirEquation {
    ciddor,          // P. E. Ciddor, Appl. Opt. 35 (1996) 1566, with the IAPWS vapour pressure
    modified_edlen,  // K. P. Birch, M. J. Downs, Metrologia 30 (1993) 155 and 31 (1994) 315; water term as in the NIST
                     // Engineering Metrology Toolbox
    edlen_1966,      // B. Edlen, Metrologia 2 (1966) 71: dispersion, density and water, with 300 ppm of carbon dioxide
};

// Accepts "ciddor", "modified_edlen" and "edlen_1966"; throws InvalidArgument for any other text.
AirEquation parse_air_equation(std::string_view text);

// Phase refractive index, dimensionless, for a vacuum wavelength of 300 to 1700 nm. Throws InvalidArgument if the
// wavelength or a quantity of `air` is outside its range.
double refractive_index(const Air& air, double wavelength, AirEquation equation = AirEquation::ciddor);

// The air around machine and head: either a constant index for every wavelength, or a state of the air.
struct Environment {
    std::variant<double, Air> air = 1.0;
    AirEquation equation = AirEquation::ciddor;
    double relative_error = 0.0;  // index = (1 + relative_error) * (constant, or value of the equation)
};
// Throws InvalidArgument for a constant below 1, and as refractive_index(Air) for a state of the air.
double refractive_index(const Environment& environment, double wavelength);

}  // namespace stepdiag
