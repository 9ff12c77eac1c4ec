#include "stepdiag/core/air.hpp"

#include <cmath>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr double celsius_zero = 273.15;  // K

void require_range(double value, double lowest, double highest, const std::string& name) {
    if (!(value >= lowest && value <= highest))
        throw InvalidArgument(name + ": expected " + std::to_string(lowest) + " to " + std::to_string(highest) +
                              ", got " + std::to_string(value));
}

void check(const Air& air, double wavelength) {
    require_range(air.temperature, -40.0, 100.0, "air temperature in degrees Celsius");
    require_range(air.pressure, 1e4, 1.4e5, "air pressure in Pa");
    require_range(air.relative_humidity, 0.0, 1.0, "air relative_humidity");
    require_range(air.carbon_dioxide, 0.0, 2000.0, "air carbon_dioxide in ppm");
    require_range(wavelength, 300.0, 1700.0, "wavelength in nm");
}

// In Pa: over water by the IAPWS formula, over ice below 0 degrees Celsius. Constants of the NIST Engineering Metrology
// Toolbox.
double saturation_vapour_pressure(double temperature) {
    const double T = temperature + celsius_zero;
    if (temperature < 0.0) {
        const double theta = T / 273.16;
        return 611.657 *
               std::exp(-13.928169 * (1.0 - std::pow(theta, -1.5)) + 34.7078238 * (1.0 - std::pow(theta, -1.25)));
    }
    const double omega = T - 2.38555575678e-1 / (T - 6.50175348448e2);
    const double a = omega * omega + 1.16705214528e3 * omega - 7.24213167032e5;
    const double b = -1.70738469401e1 * omega * omega + 1.20208247025e4 * omega - 3.23255503223e6;
    const double c = 1.49151086135e1 * omega * omega - 4.82326573616e3 * omega + 4.05113405421e5;
    const double x = 2.0 * c / (-b + std::sqrt(b * b - 4.0 * a * c));
    return 1e6 * x * x * x * x;
}

double ciddor(const Air& air, double S) {
    const double t = air.temperature, T = t + celsius_zero, p = air.pressure;
    const double enhancement = 1.00062 + 3.14e-8 * p + 5.60e-7 * t * t;
    const double x_v =
        air.relative_humidity * enhancement * saturation_vapour_pressure(t) / p;  // mole fraction of water

    // Refractivities of standard dry air with this carbon dioxide content, and of water vapour at its reference state.
    const double r_as = 1e-8 * (5792105.0 / (238.0185 - S) + 167917.0 / (57.362 - S));
    const double r_axs = r_as * (1.0 + 5.34e-7 * (air.carbon_dioxide - 450.0));
    const double r_vs = 1.022e-8 * (295.235 + S * (2.6422 + S * (-0.03238 + S * 0.004028)));

    const auto compressibility = [](double p, double t, double x) {
        const double q = p / (t + celsius_zero);
        return 1.0 -
               q * (1.58123e-6 - 2.9331e-8 * t + 1.1043e-10 * t * t + (5.707e-6 - 2.051e-8 * t) * x +
                    (1.9898e-4 - 2.376e-6 * t) * x * x) +
               q * q * (1.83e-11 - 0.765e-8 * x * x);
    };
    constexpr double R = 8.314472, M_v = 0.018015, p_R1 = 101325.0, T_R1 = 288.15, Z_a = 0.9995922115,
                     rho_vs = 0.00985938;
    const double M_a = 0.0289635 + 1.2011e-8 * (air.carbon_dioxide - 400.0);
    const double Z = compressibility(p, t, x_v);
    const double rho_axs = p_R1 * M_a / (Z_a * R * T_R1);
    const double rho_v = x_v * p * M_v / (Z * R * T);
    const double rho_a = (1.0 - x_v) * p * M_a / (Z * R * T);
    return 1.0 + rho_a / rho_axs * r_axs + rho_v / rho_vs * r_vs;
}

double vapour_pressure(const Air& air) { return air.relative_humidity * saturation_vapour_pressure(air.temperature); }

// In torr, as published.
double edlen_1966(const Air& air, double S) {
    constexpr double torr = 101325.0 / 760.0;  // Pa
    const double t = air.temperature, p = air.pressure / torr, f = vapour_pressure(air) / torr;
    const double n_s_1 = 1e-8 * (8342.13 + 2406030.0 / (130.0 - S) + 15997.0 / (38.9 - S));
    const double X = (1.0 + 1e-6 * (0.817 - 0.0133 * t) * p) / (1.0 + 0.003661 * t);
    return 1.0 + p * n_s_1 * X / 720.775 - 1e-8 * (5.722 - 0.0457 * S) * f;
}

double modified_edlen(const Air& air, double S) {
    const double t = air.temperature, p = air.pressure, p_v = vapour_pressure(air);
    const double n_s_1 = 1e-8 * (8342.54 + 2406147.0 / (130.0 - S) + 15998.0 / (38.9 - S));
    const double X = (1.0 + 1e-8 * (0.601 - 0.00972 * t) * p) / (1.0 + 0.003661 * t);
    return 1.0 + p * n_s_1 * X / 96095.43 - 1e-10 * (292.75 / (t + celsius_zero)) * (3.7345 - 0.0401 * S) * p_v;
}

}  // namespace

AirEquation parse_air_equation(std::string_view text) {
    if (text == "ciddor") return AirEquation::ciddor;
    if (text == "modified_edlen") return AirEquation::modified_edlen;
    if (text == "edlen_1966") return AirEquation::edlen_1966;
    throw InvalidArgument("air equation: expected \"ciddor\", \"modified_edlen\" or \"edlen_1966\", got \"" +
                          std::string(text) + "\"");
}

double refractive_index(const Air& air, double wavelength, AirEquation equation) {
    check(air, wavelength);
    const double S = 1e6 / (wavelength * wavelength);  // wave number squared, 1/um^2
    switch (equation) {
        case AirEquation::modified_edlen: return modified_edlen(air, S);
        case AirEquation::edlen_1966: return edlen_1966(air, S);
        default: return ciddor(air, S);
    }
}

double refractive_index(const Environment& environment, double wavelength) {
    if (const double* constant = std::get_if<double>(&environment.air)) {
        if (!(std::isfinite(*constant) && *constant >= 1.0))
            throw InvalidArgument("refractive_index: expected a finite value of at least 1");
        return *constant * (1.0 + environment.relative_error);
    }
    return refractive_index(std::get<Air>(environment.air), wavelength, environment.equation) *
           (1.0 + environment.relative_error);
}

}  // namespace stepdiag
