// What an interferometer makes of the light that comes back to its collimator.
// Two reading models. The chief ray: half the optical path of the beam's axis to the collimator's plane and back, the
// conventions' reading. The coupled mode: the phase with which the returned Gaussian couples into the fibre's mode,
// -L phi^2/2 instead of +L phi^2 for a mirror at L turned by phi (waist at the collimator), and the share of the light
// that couples.
// Both models read the same path when the light comes back along the axis: what diffraction adds to the phase of an
// aligned beam on its way (Gouy's phase and the curvature of its wave fronts, below half a wavelength in the round
// trip) is taken off, because it is no length. Lengths in mm, angles in rad, wavelengths in nm (vacuum).
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
    double aperture = 10.0;           // edge of the square in the collimator's plane that takes the beam back, mm
    double acceptance = 0.1;          // largest angle between the returned beam and the collimator's axis, rad
    double least_coupling = 0.0;      // coupled_mode: a smaller share of the light is a lost reading
    double resolution = 0.0;          // step of the distance, mm; 0: none
    double periodic_amplitude = 0.0;  // of the non-linearity, mm; its period is half a wavelength in the air
    double dead_path = 0.0;           // mm in air before the reference plane, whose index is taken as assumed
    double index_error = 0.0;         // relative error of the index that distances are reduced with, e.g. 0.5e-6
    ReadingModel model = ReadingModel::chief_ray;
};

// Throws InvalidArgument naming the value.
void check_interferometer(const Interferometer& interferometer);

// The collimator's mode: waist radius (1/e^2 of power), and the waist's place along the beam from the collimator's
// plane.
struct GaussianMode {
    double wavelength;      // vacuum, nm
    double waist_radius;    // mm
    double waist_position;  // mm, reduced (t/n)
};

// Throws InvalidArgument naming the value.
void check_gaussian_mode(const GaussianMode& mode);

// zR = pi w0^2 / wavelength, mm: a reduced length, in which the beam's cross section doubles.
double rayleigh_length(const GaussianMode& mode);

// A beam that has come back, in the collimator's frame (beam out along +z, its plane z = 0).
struct ReturnedBeam {
    Eigen::Vector2d position;   // where the axis meets the collimator's plane, mm
    Eigen::Vector3d direction;  // unit, z < 0
    double optical_length;      // sum of n t along the axis, out and back, mm
    double reduced_length;      // sum of t / n, mm
};

struct Coupling {
    double optical_length;  // round trip as the fibre's phase has it, mm
    double efficiency;      // share of the light that couples, 0 to 1
};

// Closed form of the overlap of a displaced, turned Gaussian with the mode, in a medium of index n at the collimator.
// With the complex beam parameters q0 = -z0 + i zR of the mode and q1 = q0 + (reduced length) of the returned beam,
// both in the collimator's plane, position d and transverse direction s = n (r_x, r_y), k = 2 pi / wavelength:
//   overlap = integral of returned times outgoing field (reciprocity: the mode that couples runs backwards)
//           = 2 i zR / (q0 + q1) exp(-i k (optical length + Q/2)),  Q = [d.d - 2 q1 d.s - q0 q1 s.s] / (q0 + q1)
//   optical length of the fibre's phase = optical length + Re Q / 2        (the phase of the first factor is taken off)
//   efficiency = |2 zR / (q0 + q1)|^2 exp(k Im Q)
// Paraxial, for a round beam. A. E. Siegman, Lasers (1986), ch. 17 and 20; W. B. Joyce, B. C. DeLoach, Appl. Opt. 23
// (1984) 4187.
Coupling couple(const GaussianMode& mode, const ReturnedBeam& beam, double index);

// The distance that the instrument gives; the noise and the head's constant are the caller's. In this order:
//   1. none where the beam is outside aperture or acceptance (both models), or below the least coupling (coupled_mode)
//   2. the round trip by the model, halved and divided by the index used, assumed_index (1 + index_error)
//   3. the dead path: + dead_path (true_index / (index used) - 1)
//   4. the non-linearity: + periodic_amplitude sin(2 pi (round trip) / wavelength)
//   5. rounding to a multiple of the resolution
std::optional<double> read_distance(const Interferometer& interferometer, const GaussianMode& mode,
                                    const ReturnedBeam& beam, double true_index, double assumed_index);

}  // namespace stepdiag
