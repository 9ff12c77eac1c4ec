#include <algorithm>
#include <cmath>
#include <limits>

#include "head/camera_noise.hpp"
#include "head/gaussian_fit.hpp"
#include "head/pixel_information.hpp"
#include "head/spot_search.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {
namespace {

// Converts pixels to mm from the sensor's origin.
Eigen::Vector2d on_sensor(const Camera& camera, double x, double y) {
    return {camera.pixel * (x - 0.5 * camera.columns), camera.pixel * (y - 0.5 * camera.rows)};
}

// The weights are the electrons above the threshold, so that a pixel that just exceeds it has little influence.
std::optional<Eigen::Vector2d> centre_of_gravity(const Camera& camera, const Eigen::MatrixXd& image) {
    const double brightest = image.maxCoeff() - camera.background;
    const double dark_variance = read_variance(camera) + (camera.shot_noise ? camera.background : 0.0);
    if (brightest < least_electrons || brightest < least_significance * std::sqrt(dark_variance)) return std::nullopt;

    const double threshold = camera.background + camera.threshold * brightest;
    double sum = 0.0, x = 0.0, y = 0.0;
    for (int column = 0; column < camera.columns; ++column)
        for (int row = 0; row < camera.rows; ++row) {
            const double weight = image(row, column) - threshold;
            if (weight <= 0.0) continue;
            sum += weight;
            x += weight * (column + 0.5);
            y += weight * (row + 0.5);
        }
    return on_sensor(camera, x / sum, y / sum);
}

std::optional<Eigen::Vector2d> gaussian_fit(const Camera& camera, const Eigen::MatrixXd& image) {
    const auto found = find_spot(image.array() - camera.background, read_variance(camera),
                                 camera.shot_noise ? camera.background : 0.0, camera.shot_noise);
    if (!found) return std::nullopt;
    PixelNoise noise{camera.shot_noise, read_variance(camera), saturation(camera)};
    // With shot noise only, dark pixels would have infinite weight. Without any noise, the fit is a least-squares fit.
    const double peak = image.maxCoeff() - camera.background;
    noise.variance = std::max(noise.variance, camera.shot_noise ? 1e-3 : 1e-12 * peak * peak);
    // A square of this size contains half of the power of a spot of this radius.
    const PixelSpot start{found->x, found->y, 0.9 * found->size, 2.0 * found->electrons, camera.background};
    const auto spot = fit_gaussian(image, noise, start);
    return spot ? std::optional(on_sensor(camera, spot->x, spot->y)) : std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector2d> locate(const Camera& camera, const Eigen::MatrixXd& image) {
    check_camera(camera);
    if (image.rows() != camera.rows || image.cols() != camera.columns)
        throw InvalidArgument("image: expected " + std::to_string(camera.rows) + " rows x " +
                              std::to_string(camera.columns) + " columns, got " + std::to_string(image.rows()) + " x " +
                              std::to_string(image.cols()));
    if (!image.allFinite()) throw InvalidArgument("image: expected finite numbers of electrons, got one that is not");
    return camera.centroid == Centroid::gaussian_fit ? gaussian_fit(camera, image) : centre_of_gravity(camera, image);
}

double cramer_rao_bound(const Camera& camera, const BeamSpot& spot) {
    check_camera(camera);
    check_spot(spot);
    if (!camera.shot_noise && read_variance(camera) == 0.0) return 0.0;
    const PixelInformation of_pixel(camera.shot_noise, read_variance(camera));
    const PixelSpot pixels{spot.centre.x() / camera.pixel + 0.5 * camera.columns,
                           spot.centre.y() / camera.pixel + 0.5 * camera.rows, spot.radius / camera.pixel,
                           spot.power * camera.electrons, camera.background};
    const Eigen::Matrix<double, 5, 5> all =
        information({0, 0, camera.columns, camera.rows}, of_pixel, saturation(camera), pixels);
    const auto column = solve(all, Eigen::Matrix<double, 5, 1>::Unit(0));
    return column ? camera.pixel * std::sqrt((*column)[0]) : std::numeric_limits<double>::infinity();
}

}  // namespace stepdiag
