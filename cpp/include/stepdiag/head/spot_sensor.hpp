// Where a Gaussian beam meets a sensor: the spot's irradiance, and the position that a camera or a lateral-effect position
// sensing device (PSD) gives for it.
//   radius  w(z) = w0 sqrt(1 + ((z - z0)/zR)^2), z = sum of t/n along the unfolded path, zR = pi w0^2 / lambda
//   pixel   P(x0..x1, y0..y1) = 1/4 [erf(sqrt2 (x1-xc)/w) - erf(sqrt2 (x0-xc)/w)] [same in y], of a total power of 1
// Lengths in mm, in the sensor's plane; wavelengths in nm (vacuum).
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

double beam_radius(const GaussianMode& mode, double reduced_length);
// Share of a spot's power inside a rectangle.
double power_inside(const BeamSpot& spot, const Eigen::Vector2d& low, const Eigen::Vector2d& high);

enum class Centroid {
    centre_of_gravity,  // of what exceeds a threshold
    gaussian_fit,       // maximum likelihood of position, radius, brightness and background (shot and read noise)
};
std::string name(Centroid centroid);
Centroid parse_centroid(std::string_view text);

// A pixel array. Electrons: photo-electrons of the whole spot of a beam that keeps all of the source's power.
struct Camera {
    double pixel = 0.01;          // pitch, mm
    int columns = 512, rows = 512;
    double electrons = 1e6;       // per exposure, for power 1
    double background = 0.0;      // electrons a pixel
    double read_noise = 0.0;      // standard deviation, electrons
    bool shot_noise = false;
    double full_well = 1e9;       // electrons; more are lost
    int bits = 0;                 // of the converter over the full well; 0: not quantised
    Centroid centroid = Centroid::gaussian_fit;
    double threshold = 0.1;       // centre_of_gravity: share of the brightest pixel above background
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
// centred on the sensor's origin. Noise by (seed, counter) alone; several spots (ghosts) add up.
Eigen::MatrixXd expose(const Camera& camera, const std::vector<BeamSpot>& spots, std::uint64_t seed,
                       std::uint64_t counter);

// Position in mm from the sensor's origin. None where nothing can be located.
std::optional<Eigen::Vector2d> locate(const Camera& camera, const Eigen::MatrixXd& image);
std::optional<Eigen::Vector2d> locate(const LateralEffect& device, const std::vector<BeamSpot>& spots,
                                      std::uint64_t seed, std::uint64_t counter);

// Smallest standard deviation of the position's x that any unbiased estimate can have (Cramer-Rao) for this image's
// expectation, all of position, radius, brightness and background being unknown; mm.
double cramer_rao_bound(const Camera& camera, const BeamSpot& spot);

}  // namespace stepdiag
