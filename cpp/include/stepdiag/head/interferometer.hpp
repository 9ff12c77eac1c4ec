// Reading of an interferometer from the light that returns to its collimator. There are two reading models:
//   chief ray     half the optical path of the beam's axis to the collimator's plane and back (CONVENTIONS)
//   coupled mode  phase with which the returned Gaussian beam couples into the fibre's mode, and the share of the light
//                 that couples
// For a mirror at distance L tilted by phi, the chief ray reads L + L phi^2; the coupled mode, with the waist at the
// collimator, reads L - L phi^2/2 (both to second order). Both models read the same path for light that returns along
// the axis: the phase that diffraction adds to an aligned beam is subtracted, because it is not a length. This phase
// (Gouy phase and curvature of the wave fronts) is below half a wavelength in the round trip. Lengths in mm, angles in
// rad, wavelengths in nm (vacuum).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

namespace stepdiag {

enum class ReadingModel { chief_ray, coupled_mode };

std::string name(ReadingModel model);
ReadingModel parse_reading_model(std::string_view text);  // throws InvalidArgument

struct Interferometer {
    double aperture = 10.0;           // edge of the square in the collimator's plane that receives the beam, mm
    double acceptance = 0.1;          // largest angle between the returned beam and the collimator's axis, rad
    double least_coupling = 0.0;      // coupled_mode: least share of the light; the reading is lost below it
    double resolution = 0.0;          // step of the distance, mm; 0: continuous
    double periodic_amplitude = 0.0;  // of the non-linearity, mm; its period is half a wavelength in air
    double dead_path = 0.0;           // path in air before the reference plane, not corrected for the index, mm
    double index_error = 0.0;         // relative error of the index used to reduce distances, such as 0.5e-6
    ReadingModel model = ReadingModel::chief_ray;
};

// Throws InvalidArgument, which names the value, for a value out of range.
void check_interferometer(const Interferometer& interferometer);

// Gaussian mode of the collimator: waist radius (1/e^2 of power), and position of the waist along the beam, measured
// from the collimator's plane.
struct GaussianMode {
    double wavelength;      // vacuum, nm
    double waist_radius;    // mm
    double waist_position;  // mm, reduced (t/n)
};

// Throws InvalidArgument, which names the value, for a value out of range.
void check_gaussian_mode(const GaussianMode& mode);

// Rayleigh length zR = pi w0^2 / wavelength, mm: the reduced length over which the beam's cross section doubles.
double rayleigh_length(const GaussianMode& mode);

// A returned beam in the collimator's frame (outgoing beam along +z, collimator's plane at z = 0).
struct ReturnedBeam {
    Eigen::Vector2d position;   // intersection of its axis with the collimator's plane, mm
    Eigen::Vector3d direction;  // unit vector, z < 0
    double optical_length;      // sum of n t along the axis, out and back, mm
    double reduced_length;      // sum of t / n, mm
};

struct Coupling {
    double optical_length;  // round trip that corresponds to the phase in the fibre, mm
    double efficiency;      // share of the light that couples, 0 to 1
};

// Coupling of a displaced and tilted Gaussian beam into the mode, in closed form, for a medium of index n at the
// collimator. The complex beam parameters in the collimator's plane are q0 = -z0 + i zR for the mode and
// q1 = q0 + (reduced length) for the returned beam. With position d, transverse direction s = n (r_x, r_y) and
// k = 2 pi / wavelength:
//   overlap = integral of returned times outgoing field (by reciprocity, the coupling mode propagates backwards)
//           = 2 i zR / (q0 + q1) exp(-i k (optical length + Q/2)),  Q = [d.d - 2 q1 d.s - q0 q1 s.s] / (q0 + q1)
//   optical length of the fibre's phase = optical length + Re Q / 2        (without the phase of the first factor)
//   efficiency = |2 zR / (q0 + q1)|^2 exp(k Im Q)
// Paraxial approximation, round beam. A. E. Siegman, Lasers (1986), ch. 17 and 20; W. B. Joyce, B. C. DeLoach, Appl.
// Opt. 23 (1984) 4187.
Coupling couple(const GaussianMode& mode, const ReturnedBeam& beam, double index);

// Distance reading of the instrument, mm. The caller adds noise and the head's constant. The steps are:
//   1. lost (empty) if the beam is outside aperture or acceptance (both models), or below the least coupling
//      (coupled_mode)
//   2. round trip by the model, divided by 2 and by the index used, assumed_index (1 + index_error)
//   3. dead path: + dead_path (true_index / (index used) - 1)
//   4. non-linearity: + periodic_amplitude sin(2 pi (round trip) / wavelength)
//   5. rounding to a multiple of the resolution
std::optional<double> read_distance(const Interferometer& interferometer, const GaussianMode& mode,
                                    const ReturnedBeam& beam, double true_index, double assumed_index);

}  // namespace stepdiag
