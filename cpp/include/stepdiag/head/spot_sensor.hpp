// Spot of a Gaussian beam on a sensor: its irradiance, and its position as read by a camera or a lateral-effect
// position sensing device (PSD).
//   radius  w(z) = w0 sqrt(1 + ((z - z0)/zR)^2), z = sum of t/n along the unfolded path, zR = pi w0^2 / lambda
//   pixel   P(x0..x1, y0..y1) = 1/4 [erf(sqrt2 (x1-xc)/w) - erf(sqrt2 (x0-xc)/w)] [same in y], for a total power of 1
// Spots are round; the model neglects the effect of a tilted sensor or glass on their shape. Lengths in mm, in the
// sensor's plane; wavelengths in nm (vacuum). Sources: B. E. A. Saleh, M. C. Teich, Fundamentals of Photonics, ch. 3
// (beam); K. A. Winick, J. Opt. Soc. Am. A 3 (1986) 1809 (bound of a centroid).
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

// Throws InvalidArgument for a spot that is not finite, with a radius that is not positive, or with a negative power.
void check_spot(const BeamSpot& spot);
// Radius w (1/e^2 of power), mm, after `reduced_length` (sum of t/n along the path), mm.
double beam_radius(const GaussianMode& mode, double reduced_length);
// Power of the spot inside a rectangle, as a share of the source's power.
double power_inside(const BeamSpot& spot, const Eigen::Vector2d& low, const Eigen::Vector2d& high);

enum class Centroid {
    centre_of_gravity,  // of the signal above a threshold, over the whole array
    gaussian_fit,       // maximum likelihood fit of position, radius, brightness and background (shot and read noise)
};
std::string name(Centroid centroid);
Centroid parse_centroid(std::string_view text);

// A pixel array. `electrons` is the number of photo-electrons of a whole spot with the full power of the source.
struct Camera {
    double pixel = 0.01;  // pitch, mm
    int columns = 512, rows = 512;
    double electrons = 1e6;   // per exposure, for power 1
    double background = 0.0;  // electrons per pixel; start value of the fit, which estimates the background
    double read_noise = 0.0;  // standard deviation, electrons
    bool shot_noise = false;
    double full_well = 1e9;  // electrons; a pixel saturates here
    int bits = 0;            // of the converter, whose range is 0 to full_well; 0: not quantised
    Centroid centroid = Centroid::gaussian_fit;
    double threshold = 0.05;  // centre_of_gravity: share of the brightest pixel above background
};

// A lateral-effect PSD. It reads the power centroid of all light on its active area.
struct LateralEffect {
    Eigen::Vector2d size{10.0, 10.0};  // active area, mm
    double noise = 0.0;                // standard deviation for a beam of full power, mm; proportional to 1 / power
    double resolution = 0.0;           // mm; 0: continuous
    double least_power = 1e-6;         // least share of the source's power on the area; the reading is lost below it
};

// Both throw InvalidArgument, which names the value, for a value out of range.
void check_camera(const Camera& camera);
void check_lateral_effect(const LateralEffect& device);

// Image in electrons, rows x columns. Pixel (0, 0) is at the lowest x and y; the array is centred on the sensor's
// origin. Effects in this order: spots (ghosts add up) and background, shot noise (Poisson), full well, read noise,
// converter. The noise depends on (seed, counter) only.
Eigen::MatrixXd expose(const Camera& camera, const std::vector<BeamSpot>& spots, std::uint64_t seed,
                       std::uint64_t counter);

// Position relative to the sensor's origin, mm. Empty if no spot can be located: the signal above the background is
// less than least_electrons or less than least_significance times the noise, the centre is off the array, or the fit
// does not converge. The fit ignores saturated pixels. A spot much smaller than a pixel (radius below 0.5 pixels)
// cannot be fitted.
inline constexpr double least_electrons = 1.0;
inline constexpr double least_significance = 5.0;
std::optional<Eigen::Vector2d> locate(const Camera& camera, const Eigen::MatrixXd& image);

// Power centroid of all light on the area, mm: sum of P c / sum of P, with the mean c of a clipped Gaussian in closed
// form. Empty below the device's least power.
std::optional<Eigen::Vector2d> locate(const LateralEffect& device, const std::vector<BeamSpot>& spots,
                                      std::uint64_t seed, std::uint64_t counter);

// Cramer-Rao bound: smallest standard deviation of x, mm, of any unbiased estimate for this expected image, with
// unknown position, radius, brightness and background. Each pixel has the exact information of a Poisson number plus
// Gaussian read noise; the read noise includes step^2/12 of the converter. Saturated pixels have no information. The
// bound is 0 for a camera without noise, and infinite if the position is not observable.
double cramer_rao_bound(const Camera& camera, const BeamSpot& spot);

}  // namespace stepdiag
