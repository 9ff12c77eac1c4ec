// Where a Gaussian beam meets a sensor: the spot's irradiance, and the position that a camera or a lateral-effect
// position sensing device (PSD) gives for it.
//   radius  w(z) = w0 sqrt(1 + ((z - z0)/zR)^2), z = sum of t/n along the unfolded path, zR = pi w0^2 / lambda
//   pixel   P(x0..x1, y0..y1) = 1/4 [erf(sqrt2 (x1-xc)/w) - erf(sqrt2 (x0-xc)/w)] [same in y], of a total power of 1
// Spots are round: what a slanted sensor or glass makes of them is left out. Lengths in mm, in the sensor's plane;
// wavelengths in nm (vacuum). Sources: B. E. A. Saleh, M. C. Teich, Fundamentals of Photonics, ch. 3 (beam); K. A.
// Winick, J. Opt. Soc. Am. A 3 (1986) 1809 (bound of a centroid).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/head/interferometer.hpp"

namespace stepdiag {

struct BeamSpot {
    Eigen::Vector2d centre;  // mm
    double radius;           // 1/e^2 of power, mm
    double power;            // share of the source's power
};

// Throws InvalidArgument for a spot that is not finite, has no radius or a negative power.
void check_spot(const BeamSpot& spot);
double beam_radius(const GaussianMode& mode, double reduced_length);
// Share of the source's power that a spot has inside a rectangle.
double power_inside(const BeamSpot& spot, const Eigen::Vector2d& low, const Eigen::Vector2d& high);

enum class Centroid {
    centre_of_gravity,  // of what exceeds a threshold, over all of the array
    gaussian_fit,       // maximum likelihood of position, radius, brightness and background (shot and read noise)
};
std::string name(Centroid centroid);
Centroid parse_centroid(std::string_view text);

// A pixel array. Electrons: photo-electrons of the whole spot of a beam that keeps all of the source's power.
struct Camera {
    double pixel = 0.01;  // pitch, mm
    int columns = 512, rows = 512;
    double electrons = 1e6;   // per exposure, for power 1
    double background = 0.0;  // electrons a pixel; the fit finds its own, and starts from this
    double read_noise = 0.0;  // standard deviation, electrons
    bool shot_noise = false;
    double full_well = 1e9;  // electrons; more are lost
    int bits = 0;            // of the converter over the full well, which knows no negative numbers; 0: not quantised
    Centroid centroid = Centroid::gaussian_fit;
    double threshold = 0.05;  // centre_of_gravity: share of the brightest pixel above background
};

// A lateral-effect PSD: the power centroid of what falls on its active area.
struct LateralEffect {
    Eigen::Vector2d size{10.0, 10.0};  // active area, mm
    double noise = 0.0;                // standard deviation for a beam of full power; grows as 1 / power, mm
    double resolution = 0.0;           // mm; 0: none
    double least_power = 1e-6;         // share of the source's power on the area, below which a reading is lost
};

void check_camera(const Camera& camera);  // throw InvalidArgument naming the value
void check_lateral_effect(const LateralEffect& device);

// Image in electrons after all of the camera's effects, rows x columns; pixel (0, 0) at the lowest x and y, the array
// centred on the sensor's origin. In this order: spots (ghosts add up) and background, shot noise (Poisson), full well,
// read noise, converter. Noise by (seed, counter) alone.
Eigen::MatrixXd expose(const Camera& camera, const std::vector<BeamSpot>& spots, std::uint64_t seed,
                       std::uint64_t counter);

// Position in mm from the sensor's origin. None where nothing can be located: less than least_electrons, or than
// least_significance times the noise, above the background; a spot whose centre is off the array; no convergence.
// Saturated pixels are left out of the fit. A spot much smaller than a pixel (radius below 0.5) has no fit.
inline constexpr double least_electrons = 1.0;
inline constexpr double least_significance = 5.0;
std::optional<Eigen::Vector2d> locate(const Camera& camera, const Eigen::MatrixXd& image);

// Power centroid of all that falls on the area: sum of P c / sum of P, with the closed form of a clipped Gaussian's
// mean.
std::optional<Eigen::Vector2d> locate(const LateralEffect& device, const std::vector<BeamSpot>& spots,
                                      std::uint64_t seed, std::uint64_t counter);

// Smallest standard deviation of the position's x that any unbiased estimate can have (Cramer-Rao) for this image's
// expectation, all of position, radius, brightness and background being unknown; mm. Pixels have the exact information
// of a Poisson number plus Gaussian read noise, which the converter's step^2/12 adds to; saturated ones have none. 0
// for a camera without noise, infinite where position is not observable.
double cramer_rao_bound(const Camera& camera, const BeamSpot& spot);

}  // namespace stepdiag
