#include "stepdiag/head/spot_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "head/camera_noise.hpp"
#include "head/checks.hpp"
#include "head/gaussian_fit.hpp"
#include "head/pixel_information.hpp"
#include "head/spot_profile.hpp"
#include "head/spot_search.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"

namespace stepdiag {
namespace {

// Expected number of electrons of each pixel.
Eigen::MatrixXd expectation(const Camera& camera, const std::vector<BeamSpot>& spots) {
    Eigen::MatrixXd electrons = Eigen::MatrixXd::Constant(camera.rows, camera.columns, camera.background);
    for (const BeamSpot& spot : spots) {
        check_spot(spot);
        const auto shares = [&](double centre, int count) {
            return pixel_shares(centre, spot.radius, -0.5 * count * camera.pixel, camera.pixel, count);
        };
        const Eigen::VectorXd across = camera.electrons * spot.power * shares(spot.centre.x(), camera.columns);
        electrons.noalias() += shares(spot.centre.y(), camera.rows).matrix() * across.transpose();
    }
    return electrons;
}

}  // namespace

std::string name(Centroid centroid) {
    return centroid == Centroid::centre_of_gravity ? "centre_of_gravity" : "gaussian_fit";
}

Centroid parse_centroid(std::string_view text) {
    for (const Centroid centroid : {Centroid::centre_of_gravity, Centroid::gaussian_fit})
        if (text == name(centroid)) return centroid;
    throw InvalidArgument("centroid: expected \"centre_of_gravity\" or \"gaussian_fit\", got \"" + std::string(text) +
                          "\"");
}

void check_camera(const Camera& camera) {
    const Check check{"camera"};
    check.positive("pixel", camera.pixel, "a pitch in mm");
    check.within("columns", camera.columns, 4, 16384, "a number of pixels");
    check.within("rows", camera.rows, 4, 16384, "a number of pixels");
    check.positive("electrons", camera.electrons, "a number of electrons");
    check.within("electrons", camera.electrons, 0.0, 1e15, "a number of electrons");
    check.within("background", camera.background, 0.0, 1e15, "a number of electrons");
    check.not_negative("read_noise", camera.read_noise, "a number of electrons");
    check.positive("full_well", camera.full_well, "a number of electrons");
    check.within("bits", camera.bits, 0, 32, "a number of bits");
    check.within("threshold", camera.threshold, 0.0, 0.99, "a share of the brightest pixel");
}

Eigen::MatrixXd expose(const Camera& camera, const std::vector<BeamSpot>& spots, std::uint64_t seed,
                       std::uint64_t counter) {
    check_camera(camera);
    Eigen::MatrixXd image = expectation(camera, spots);
    double* const pixel = image.data();
    const auto count = std::uint32_t(image.size());

    if (camera.shot_noise)
        for (std::uint32_t i = 0; i < count; ++i)
            pixel[i] = poisson(pixel[i], seed, RandomStream::camera_shot_noise, counter, i);

    image = image.cwiseMin(camera.full_well);

    if (camera.read_noise > 0.0)
        for (std::uint32_t i = 0; i < count; i += 2) {  // one pair of numbers for two pixels
            const auto noise = normal_pair(seed, RandomStream::camera_read_noise, RandomBlock{counter, i / 2});
            pixel[i] += camera.read_noise * noise[0];
            if (i + 1 < count) pixel[i + 1] += camera.read_noise * noise[1];
        }

    image = image.cwiseMin(camera.full_well);  // also the upper limit of the converter
    if (const double step = converter_step(camera); step > 0.0)
        image = step * (image.cwiseMax(0.0) / step).array().round();
    return image;
}

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

void check_lateral_effect(const LateralEffect& device) {
    const Check check{"position device"};
    check.positive("size", device.size.x(), "a width in mm");
    check.positive("size", device.size.y(), "a height in mm");
    check.not_negative("noise", device.noise, "a length in mm");
    check.not_negative("resolution", device.resolution, "a length in mm");
    check.positive("least_power", device.least_power, "a share of the source's power");
    check.within("least_power", device.least_power, 0.0, 1.0, "a share of the source's power");
}

std::optional<Eigen::Vector2d> locate(const LateralEffect& device, const std::vector<BeamSpot>& spots,
                                      std::uint64_t seed, std::uint64_t counter) {
    const Eigen::Vector2d high = device.size / 2.0, low = -high;
    double power = 0.0;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    for (const BeamSpot& spot : spots) {
        check_spot(spot);
        const double width = share_between(low.x(), high.x(), spot.centre.x(), spot.radius);
        const double height = share_between(low.y(), high.y(), spot.centre.y(), spot.radius);
        power += spot.power * width * height;
        moment.x() += spot.power * moment_between(low.x(), high.x(), spot.centre.x(), spot.radius) * height;
        moment.y() += spot.power * moment_between(low.y(), high.y(), spot.centre.y(), spot.radius) * width;
    }
    if (!(power >= device.least_power)) return std::nullopt;

    Eigen::Vector2d position = moment / power;
    if (device.noise > 0.0) {
        const auto noise = normal_pair(seed, RandomStream::position_device, counter);
        position += device.noise / power * Eigen::Vector2d(noise[0], noise[1]);
    }
    if (device.resolution > 0.0) position = device.resolution * (position / device.resolution).array().round();
    return position;
}

}  // namespace stepdiag
