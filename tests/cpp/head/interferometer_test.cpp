#include "stepdiag/head/interferometer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <random>

#include "stepdiag/core/units.hpp"
#include "support/refuses.hpp"
#include "support/special_numbers.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::GaussianMode;
using stepdiag::Interferometer;
using stepdiag::pi;
using stepdiag::ReadingModel;
using stepdiag::ReturnedBeam;
using stepdiag::test::undefined;
using Complex = std::complex<double>;

// Field of a Gaussian beam of power 1 by its textbook radius, curvature and Gouy phase, `z` behind its waist.
Complex field(const GaussianMode& mode, double r2, double z) {
    const double wavelength = mode.wavelength * 1e-6, k = 2.0 * pi / wavelength;
    const double zR = pi * mode.waist_radius * mode.waist_radius / wavelength;
    const double w = mode.waist_radius * std::sqrt(1.0 + z * z / (zR * zR));
    const double curvature = z / (z * z + zR * zR);
    return std::sqrt(2.0 / pi) / w * std::exp(Complex(-r2 / (w * w), -k * r2 * curvature / 2.0 + std::atan2(z, zR)));
}

// The overlap integral by the trapezoidal rule, which converges exponentially for what falls off as a Gaussian.
Complex overlap(const GaussianMode& mode, const ReturnedBeam& beam, double index) {
    const double k = 2.0 * pi / (mode.wavelength * 1e-6);
    const Vector2d s = index * beam.direction.head<2>();
    const double step = mode.waist_radius / 16.0;
    Complex sum = 0.0;
    for (int i = -80; i <= 80; ++i)
        for (int j = -80; j <= 80; ++j) {
            const Vector2d p(i * step, j * step), from_axis = p - beam.position;
            sum += field(mode, p.squaredNorm(), -mode.waist_position) * std::polar(1.0, -k * s.dot(from_axis)) *
                   field(mode, from_axis.squaredNorm(), beam.reduced_length - mode.waist_position);
        }
    return sum * step * step;
}

Vector3d backwards(double x, double y) { return {x, y, -std::sqrt(1.0 - x * x - y * y)}; }

// A mirror at `length`, turned by `phi` about the point where the axis meets it, in vacuum.
ReturnedBeam from_mirror(double length, double phi) {
    const double t = std::tan(2.0 * phi);
    const double path = length + length / std::cos(2.0 * phi);
    return {{length * t, 0.0}, {std::sin(2.0 * phi), 0.0, -std::cos(2.0 * phi)}, path, path};
}

Interferometer coupled() {
    Interferometer interferometer;
    interferometer.model = ReadingModel::coupled_mode;
    return interferometer;
}

}  // namespace

TEST(Interferometer, CouplingIsTheOverlapIntegral) {
    std::mt19937_64 engine(1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 20; ++i) {
        const GaussianMode mode{1100.0 + 450.0 * unit(engine), 0.8 + 0.3 * unit(engine), 700.0 * unit(engine)};
        const ReturnedBeam beam{{unit(engine), unit(engine)},
                                backwards(4e-4 * unit(engine), 4e-4 * unit(engine)),
                                0.0,  // whose rounding would hide that of its change

                                1300.0 + 1200.0 * unit(engine)};
        const double index = 1.0 + 0.2 * std::abs(unit(engine));
        const Complex numeric = overlap(mode, beam, index);
        const auto closed = couple(mode, beam, index);
        EXPECT_NEAR(closed.efficiency, std::norm(numeric), 1e-12);  // the integral's truncation and roundings

        const ReturnedBeam aligned{{0.0, 0.0}, backwards(0.0, 0.0), 0.0, beam.reduced_length};
        const double phase = std::arg(numeric / overlap(mode, aligned, index));
        const double k = 2.0 * pi / (mode.wavelength * 1e-6);
        const double turns = (k * closed.optical_length + phase) / (2.0 * pi);
        // Roundings of the numeric overlap, of about 1e-15, turn the phase of a weak one.
        EXPECT_NEAR(turns - std::round(turns), 0.0, 1e-12 + 1e-15 / std::abs(numeric));
    }
}

TEST(Interferometer, AlignedBeamReadsItsPathWhateverItsDiffraction) {
    for (const double waist : {-500.0, 0.0, 900.0}) {
        const GaussianMode mode{1530.0, 0.8, waist};
        const auto coupling = couple(mode, from_mirror(1200.0, 0.0), 1.0);
        EXPECT_EQ(coupling.optical_length, 2400.0);
        const double off = (1200.0 - waist) / rayleigh_length(mode);       // from a waist that is its own image
        EXPECT_NEAR(coupling.efficiency, 1.0 / (1.0 + off * off), 1e-15);  // roundings
    }
}

TEST(Interferometer, TurnedMirrorIsNearerByHalfWhatItIsFartherForTheChiefRay) {
    const GaussianMode mode{1530.0, 0.8, 0.0};
    for (const double phi : {100e-6, 300e-6, 600e-6}) {
        const double second_order = 1200.0 * phi * phi;
        const auto beam = from_mirror(1200.0, phi);
        EXPECT_NEAR(*read_distance({}, mode, beam, 1.0, 1.0) - 1200.0, second_order, 1e-9);  // fourth order: 1e-9 mm
        EXPECT_NEAR(*read_distance(coupled(), mode, beam, 1.0, 1.0) - 1200.0, -second_order / 2.0, 1e-9);
    }
    // -54 nm at 300 urad, where the chief ray has +108 nm.
    EXPECT_NEAR(*read_distance(coupled(), mode, from_mirror(1200.0, 300e-6), 1.0, 1.0), 1200.0 - 54e-6, 1e-9);
}

TEST(Interferometer, WaistOnTheMirrorTakesTheSecondOrderAway) {
    const GaussianMode mode{1530.0, 0.8, 1200.0};
    EXPECT_NEAR(*read_distance(coupled(), mode, from_mirror(1200.0, 300e-6), 1.0, 1.0), 1200.0, 1e-10);  // 4th order
}

TEST(Interferometer, TiltCostsLightAsTheAngleOverTheDivergence) {
    const GaussianMode mode{1530.0, 0.8, 0.0};
    const double aligned = couple(mode, from_mirror(1200.0, 0.0), 1.0).efficiency;
    for (const double phi : {300e-6, 600e-6}) {
        const double loss = std::exp(-std::pow(2.0 * pi * 0.8 * phi / 1530e-6, 2));
        EXPECT_NEAR(couple(mode, from_mirror(1200.0, phi), 1.0).efficiency, aligned * loss, 1e-6);  // fourth order
    }
    EXPECT_NEAR(couple(mode, from_mirror(1200.0, 300e-6), 1.0).efficiency, 0.206, 5e-4);
    EXPECT_NEAR(couple(mode, from_mirror(1200.0, 600e-6), 1.0).efficiency, 0.011, 5e-4);
}

TEST(Interferometer, BeamOutsideApertureAcceptanceOrCouplingIsALostReading) {
    const GaussianMode mode{1530.0, 0.8, 0.0};
    const auto reads = [&](const Interferometer& i, double x, double y, double angle) {
        return read_distance(i, mode, {{x, y}, backwards(angle, 0.0), 100.0, 100.0}, 1.0, 1.0).has_value();
    };
    for (const auto model : {ReadingModel::chief_ray, ReadingModel::coupled_mode}) {
        Interferometer interferometer;
        interferometer.model = model;
        EXPECT_TRUE(reads(interferometer, 4.99, -4.99, 0.099));
        EXPECT_FALSE(reads(interferometer, 5.01, 0.0, 0.0));
        EXPECT_FALSE(reads(interferometer, 0.0, -5.01, 0.0));
        EXPECT_FALSE(reads(interferometer, 0.0, 0.0, 0.101));
        EXPECT_FALSE(reads(interferometer, undefined, 0.0, 0.0));
    }
    Interferometer weak = coupled();
    weak.least_coupling = 0.5;
    EXPECT_TRUE(reads(weak, 0.0, 0.0, 0.0));
    EXPECT_FALSE(reads(weak, 0.0, 0.0, 1e-3));
    weak.model = ReadingModel::chief_ray;
    EXPECT_TRUE(reads(weak, 0.0, 0.0, 1e-3));
}

TEST(Interferometer, EffectsComeInTheirOrder) {
    const GaussianMode mode{1530.0, 0.8, 0.0};
    const double n = 1.00027, believed = 1.00026;
    const ReturnedBeam beam{{0.0, 0.0}, backwards(0.0, 0.0), 2.0 * 1000.0 * n, 2.0 * 1000.0 / n};
    Interferometer i;
    const auto reading = [&] { return *read_distance(i, mode, beam, n, believed); };
    EXPECT_NEAR(reading(), 1000.0 * n / believed, 1e-12);  // roundings of 1000 mm, here and below
    i.index_error = 0.5e-6;
    const double used = believed * (1.0 + 0.5e-6);
    EXPECT_NEAR(reading(), 1000.0 * n / used, 1e-12);
    i.dead_path = 200.0;
    const double with_dead_path = 1000.0 * n / used + 200.0 * (n / used - 1.0);
    EXPECT_NEAR(reading(), with_dead_path, 1e-12);
    i.periodic_amplitude = 5e-6;
    // The phase of 1.3e6 waves is rounded to 2e-9 rad.
    const double non_linearity = 5e-6 * std::sin(4.0 * pi * n * 1000.0 / 1530e-6);
    EXPECT_NEAR(reading(), with_dead_path + non_linearity, 1e-12);
    i.resolution = 1e-5;
    EXPECT_NEAR(reading(), 1e-5 * std::round((with_dead_path + non_linearity) / 1e-5), 1e-12);
}

TEST(Interferometer, PeriodicNonLinearityRepeatsAfterHalfAWavelength) {
    const GaussianMode mode{633.0, 0.5, 0.0};
    Interferometer i;
    i.periodic_amplitude = 2e-6;
    const auto error = [&](double distance) {
        return *read_distance(i, mode, {{0, 0}, {0, 0, -1}, 2.0 * distance, 2.0 * distance}, 1.0, 1.0) - distance;
    };
    const double period = 633e-6 / 2.0;
    for (const double d : {0.0, 10.0}) {  // where a wave is resolved to 1e-11
        EXPECT_NEAR(error(d + 0.25 * period) - error(d + 0.75 * period), 4e-6 * std::cos(2.0 * pi * d / period), 1e-13);
        EXPECT_NEAR(error(d + 0.3 * period), error(d + 1.3 * period), 1e-13);
    }
}

TEST(Interferometer, NamesOfReadingModelsAreReadBack) {
    for (const char* text : {"chief_ray", "coupled_mode"}) EXPECT_EQ(name(stepdiag::parse_reading_model(text)), text);
    for (const char* text : {"", "chief", "Chief_Ray"})
        expect_refused([&] { stepdiag::parse_reading_model(text); }, "reading_model");
}

TEST(Interferometer, WhatIsOutOfRangeIsRefusedByItsName) {
    const auto change = [](auto edit) {
        Interferometer i;
        edit(i);
        return [i] { check_interferometer(i); };
    };
    for (const double bad : {0.0, -1.0, undefined, double(INFINITY)})
        expect_refused(change([&](auto& i) { i.aperture = bad; }), "interferometer aperture");
    for (const double bad : {-0.1, 1.6, undefined})
        expect_refused(change([&](auto& i) { i.acceptance = bad; }), "acceptance");
    for (const double bad : {-0.1, 1.1, undefined})
        expect_refused(change([&](auto& i) { i.least_coupling = bad; }), "least_coupling");
    for (const double bad : {-1e-9, undefined, double(INFINITY)}) {
        expect_refused(change([&](auto& i) { i.resolution = bad; }), "resolution");
        expect_refused(change([&](auto& i) { i.periodic_amplitude = bad; }), "periodic_amplitude");
        expect_refused(change([&](auto& i) { i.dead_path = bad; }), "dead_path");
    }
    for (const double bad : {0.5, undefined})
        expect_refused(change([&](auto& i) { i.index_error = bad; }), "index_error");
    EXPECT_NO_THROW(stepdiag::check_interferometer({}));

    expect_refused([] { stepdiag::check_gaussian_mode({0.0, 0.8, 0.0}); }, "wavelength");
    expect_refused([] { stepdiag::check_gaussian_mode({1530.0, undefined, 0.0}); }, "waist_radius");
    expect_refused([] { stepdiag::check_gaussian_mode({1530.0, 0.8, undefined}); }, "waist_position");
}
