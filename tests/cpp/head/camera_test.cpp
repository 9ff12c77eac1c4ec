#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "stepdiag/head/spot_sensor.hpp"
#include "support/refuses.hpp"
#include "support/special_numbers.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using stepdiag::BeamSpot;
using stepdiag::Camera;
using stepdiag::Centroid;
using stepdiag::test::infinite;
using stepdiag::test::undefined;

Camera small_camera() {
    Camera camera;
    camera.columns = 80;
    camera.rows = 60;
    return camera;
}

MatrixXd uniform(const Camera& camera) { return expose(camera, {}, 5, 9); }

double variance(const MatrixXd& image) { return (image.array() - image.mean()).square().mean(); }

}  // namespace

TEST(Camera, PixelsHoldTheIntegralsOfTheSpotAndTheArrayItsEnergy) {
    Camera camera = small_camera();
    camera.background = 3.0;
    const BeamSpot spot{{0.0123, -0.0456}, 0.05, 0.5}, ghost{{-0.2, 0.1}, 0.08, 0.01};
    const MatrixXd image = expose(camera, {spot, ghost}, 0, 0);
    ASSERT_EQ(image.rows(), 60);
    ASSERT_EQ(image.cols(), 80);
    for (int row = 0; row < 60; ++row)
        for (int column = 0; column < 80; ++column) {
            const Vector2d low(0.01 * (column - 40), 0.01 * (row - 30)), high = low + Vector2d(0.01, 0.01);
            const double power = power_inside(spot, low, high) + power_inside(ghost, low, high);
            EXPECT_NEAR(image(row, column), 3.0 + 1e6 * power, 1e-9);  // roundings of 1e6 electrons
        }
    const double power = power_inside(spot, {-0.4, -0.3}, {0.4, 0.3}) + power_inside(ghost, {-0.4, -0.3}, {0.4, 0.3});
    EXPECT_NEAR(image.sum(), 3.0 * 80 * 60 + 1e6 * power, 1e-8);
}

TEST(Camera, ShotNoiseIsPoissonAndReadNoiseGaussian) {
    Camera camera;
    camera.columns = camera.rows = 200;
    const double n = camera.columns * camera.rows;  // limits: five standard deviations of the sample's moments
    for (const double background : {0.5, 40.0}) {
        camera.background = background;
        camera.shot_noise = true;
        camera.read_noise = 0.0;
        const MatrixXd shot = uniform(camera);
        EXPECT_NEAR(shot.mean(), background, 5.0 * std::sqrt(background / n));
        EXPECT_NEAR(variance(shot), background, 5.0 * std::sqrt((2.0 * background * background + background) / n));
        EXPECT_EQ(shot, shot.array().round().matrix());  // whole electrons
        camera.shot_noise = false;
        camera.read_noise = 2.0;
        const MatrixXd read = uniform(camera);
        EXPECT_NEAR(read.mean(), background, 5.0 * 2.0 / std::sqrt(n));
        EXPECT_NEAR(variance(read), 4.0, 5.0 * 4.0 * std::sqrt(2.0 / n));
    }
}

TEST(Camera, NoiseComesFromSeedAndCounterAlone) {
    Camera camera = small_camera();
    camera.shot_noise = true;
    camera.read_noise = 1.5;
    camera.background = 20.0;
    const BeamSpot spot{{0.0, 0.0}, 0.05, 1.0};
    EXPECT_EQ(expose(camera, {spot}, 3, 4), expose(camera, {spot}, 3, 4));
    EXPECT_NE(expose(camera, {spot}, 3, 4), expose(camera, {spot}, 3, 5));
    EXPECT_NE(expose(camera, {spot}, 3, 4), expose(camera, {spot}, 4, 4));
    // Every pixel has numbers of its own.
    const MatrixXd image = uniform(camera);
    EXPECT_GT(std::set<double>(image.data(), image.data() + image.size()).size(), std::size_t(4790));
}

TEST(Camera, FullWellAndConverterEndAndStepTheScale) {
    Camera camera = small_camera();
    camera.full_well = 1000.0;
    camera.bits = 8;
    const double step = 1000.0 / 255.0;
    const MatrixXd image = expose(camera, {{{0.0, 0.0}, 0.05, 1.0}}, 0, 0);
    EXPECT_NEAR(image.maxCoeff(), 1000.0, 1e-10);
    EXPECT_LT((image / step - (image / step).array().round().matrix()).cwiseAbs().maxCoeff(), 1e-12);
    camera.bits = 0;
    const MatrixXd fine = expose(camera, {{{0.0, 0.0}, 0.05, 1.0}}, 0, 0);
    EXPECT_LE((image - fine).cwiseAbs().maxCoeff(), step / 2.0 + 1e-10);

    camera.read_noise = 5.0;
    camera.bits = 8;
    EXPECT_GE(expose(camera, {}, 0, 0).minCoeff(), 0.0);  // the converter knows no negative numbers
    camera.bits = 0;
    EXPECT_LT(expose(camera, {}, 0, 0).minCoeff(), 0.0);
    EXPECT_LE(expose(camera, {{{0.0, 0.0}, 0.05, 1.0}}, 0, 0).maxCoeff(), 1000.0);
}

TEST(Camera, NamesOfCentroidsAreReadBack) {
    for (const char* text : {"centre_of_gravity", "gaussian_fit"})
        EXPECT_EQ(name(stepdiag::parse_centroid(text)), text);
    for (const char* text : {"", "center_of_gravity", "fit"})
        expect_refused([&] { stepdiag::parse_centroid(text); }, "centroid");
}

TEST(Camera, WhatIsOutOfRangeIsRefusedByItsName) {
    const auto change = [](auto edit) {
        Camera camera;
        edit(camera);
        return [camera] { check_camera(camera); };
    };
    for (const double bad : {0.0, -1.0, undefined, infinite}) {
        expect_refused(change([&](auto& c) { c.pixel = bad; }), "camera pixel");
        expect_refused(change([&](auto& c) { c.electrons = bad; }), "camera electrons");
        expect_refused(change([&](auto& c) { c.full_well = bad; }), "camera full_well");
    }
    for (const double bad : {-1.0, undefined, infinite}) {
        expect_refused(change([&](auto& c) { c.background = bad; }), "camera background");
        expect_refused(change([&](auto& c) { c.read_noise = bad; }), "camera read_noise");
        expect_refused(change([&](auto& c) { c.threshold = bad; }), "camera threshold");
    }
    for (const int bad : {-1, 0, 3, 20000}) {
        expect_refused(change([&](auto& c) { c.columns = bad; }), "camera columns");
        expect_refused(change([&](auto& c) { c.rows = bad; }), "camera rows");
    }
    for (const int bad : {-1, 33}) expect_refused(change([&](auto& c) { c.bits = bad; }), "camera bits");
    expect_refused(change([&](auto& c) { c.threshold = 1.0; }), "camera threshold");
    EXPECT_NO_THROW(stepdiag::check_camera({}));
    expect_refused([] { expose(Camera{}, {BeamSpot{{0.0, 0.0}, undefined, 1.0}}, 0, 0); }, "spot radius");
    expect_refused([] { locate(small_camera(), MatrixXd::Zero(80, 60)); }, "image: expected 60 rows x 80 columns");
    expect_refused([] { locate(small_camera(), MatrixXd::Constant(60, 80, undefined)); }, "image");
    expect_refused([] { cramer_rao_bound(Camera{}, BeamSpot{{0.0, 0.0}, 0.0, 1.0}); }, "spot radius");
}
