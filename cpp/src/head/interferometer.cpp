#include "stepdiag/head/interferometer.hpp"

#include <cmath>
#include <complex>

#include "head/checks.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {

std::string name(ReadingModel model) { return model == ReadingModel::chief_ray ? "chief_ray" : "coupled_mode"; }

ReadingModel parse_reading_model(std::string_view text) {
    for (const ReadingModel model : {ReadingModel::chief_ray, ReadingModel::coupled_mode})
        if (text == name(model)) return model;
    throw InvalidArgument("reading_model: expected \"chief_ray\" or \"coupled_mode\", got \"" + std::string(text) +
                          "\"");
}

void check_interferometer(const Interferometer& interferometer) {
    const Check check{"interferometer"};
    check.positive("aperture", interferometer.aperture, "a length in mm");
    check.within("acceptance", interferometer.acceptance, 0.0, pi / 2.0, "an angle in rad");
    check.within("least_coupling", interferometer.least_coupling, 0.0, 1.0, "a share of the light");
    check.not_negative("resolution", interferometer.resolution, "a length in mm");
    check.not_negative("periodic_amplitude", interferometer.periodic_amplitude, "a length in mm");
    check.not_negative("dead_path", interferometer.dead_path, "a length in mm");
    // Catches 0.5 ppm given as 0.5, which would otherwise only show as wrong distances.
    check.within("index_error", interferometer.index_error, -0.01, 0.01, "a relative error");
}

void check_gaussian_mode(const GaussianMode& mode) {
    const Check check{"beam"};
    check.positive("wavelength", mode.wavelength, "a vacuum wavelength in nm");
    check.positive("waist_radius", mode.waist_radius, "a length in mm");
    check.finite("waist_position", mode.waist_position, "a length in mm");
}

double rayleigh_length(const GaussianMode& mode) {
    constexpr double mm_per_nm = 1e-6;
    return pi * mode.waist_radius * mode.waist_radius / (mode.wavelength * mm_per_nm);
}

Coupling couple(const GaussianMode& mode, const ReturnedBeam& beam, double index) {
    const double zR = rayleigh_length(mode);
    const double k = 2.0 * zR / (mode.waist_radius * mode.waist_radius);
    const std::complex<double> q0(-mode.waist_position, zR);
    const std::complex<double> q1 = q0 + beam.reduced_length;
    const Eigen::Vector2d d = beam.position;
    const Eigen::Vector2d s = index * beam.direction.head<2>();
    const std::complex<double> Q = (d.squaredNorm() - 2.0 * q1 * d.dot(s) - q0 * q1 * s.squaredNorm()) / (q0 + q1);
    return {beam.optical_length + Q.real() / 2.0, std::norm(2.0 * zR / (q0 + q1)) * std::exp(k * Q.imag())};
}

std::optional<double> read_distance(const Interferometer& interferometer, const GaussianMode& mode,
                                    const ReturnedBeam& beam, double true_index, double assumed_index) {
    const double angle = std::atan2(beam.direction.head<2>().norm(), -beam.direction.z());
    // The negated comparisons also treat NaN as lost.
    if (!(beam.position.cwiseAbs().maxCoeff() <= interferometer.aperture / 2.0)) return std::nullopt;
    if (!(angle <= interferometer.acceptance)) return std::nullopt;

    double round_trip = beam.optical_length;
    if (interferometer.model == ReadingModel::coupled_mode) {
        const Coupling coupling = couple(mode, beam, true_index);
        if (!(coupling.efficiency >= interferometer.least_coupling)) return std::nullopt;
        round_trip = coupling.optical_length;
    }

    const double index_used = assumed_index * (1.0 + interferometer.index_error);
    double distance = round_trip / (2.0 * index_used);
    if (interferometer.dead_path != 0.0) distance += interferometer.dead_path * (true_index / index_used - 1.0);
    if (interferometer.periodic_amplitude != 0.0) {
        const double wavelength = mode.wavelength * 1e-6;  // mm
        distance += interferometer.periodic_amplitude * std::sin(2.0 * pi * std::fmod(round_trip / wavelength, 1.0));
    }
    if (interferometer.resolution > 0.0)
        distance = interferometer.resolution * std::round(distance / interferometer.resolution);
    return distance;
}

}  // namespace stepdiag
