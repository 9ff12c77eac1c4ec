#include <cmath>

#include "head/camera_noise.hpp"
#include "head/checks.hpp"
#include "head/spot_profile.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/head/spot_sensor.hpp"

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

}  // namespace stepdiag
