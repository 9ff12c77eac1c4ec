#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "head/gaussian_fit.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using stepdiag::BeamSpot;
using stepdiag::Camera;
using stepdiag::Centroid;

// Large enough that no light of a spot of this radius (pixels) near its middle is lost.
Camera camera_for(double radius, double electrons) {
    Camera camera;
    camera.columns = int(6.0 * radius) + 16;
    camera.rows = camera.columns + 4;
    camera.electrons = electrons;
    return camera;
}

// The i-th place of a spot within a pixel of the middle, in mm.
Vector2d place(int i) { return 0.01 * Vector2d(std::fmod(0.618 * i, 1.0) - 0.5, std::fmod(0.755 * i, 1.0) - 0.5); }

}  // namespace

TEST(Centroid, OfAnImageWithoutNoiseIsTheSpotsCentre) {
    for (const double radius : {2.0, 3.5, 8.0, 20.0})
        for (int i = 0; i < 20; ++i) {
            Camera camera = camera_for(radius, 1e5);
            camera.background = 12.0;
            const BeamSpot spot{place(i), 0.01 * radius, 0.7};
            const MatrixXd image = expose(camera, {spot}, 0, 0);
            // In pixels. The fit stops a thousandth of its uncertainty off, and converges quadratically before.
            EXPECT_LT((*locate(camera, image) - spot.centre).norm() / 0.01, 1e-6) << radius;
            camera.shot_noise = true;
            camera.read_noise = 3.0;
            EXPECT_LT((*locate(camera, image) - spot.centre).norm() / 0.01, 1e-6) << radius;
            camera.centroid = Centroid::centre_of_gravity;
            EXPECT_LT((*locate(camera, image) - spot.centre).norm() / 0.01, 0.01) << radius;
        }
}

TEST(Centroid, FitIsWithinATenthOfTheCramerRaoBound) {
    for (const double read_noise : {0.0, 1.5})
        for (const double radius : {2.0, 4.0}) {  // up to 20, and 1e6 electrons, in the Python tests
            Camera camera = camera_for(radius, 1e3);
            camera.shot_noise = true;
            camera.read_noise = read_noise;
            // 600 images give 1200 errors, whose deviation is known to 1/sqrt(2400) = 2 %: 1.1 is five of that.
            constexpr int images = 600;
            double square = 0.0;
            for (int i = 0; i < images; ++i) {
                const BeamSpot spot{place(i % 4), 0.01 * radius, 1.0};
                const auto position = locate(camera, expose(camera, {spot}, 17, i));
                ASSERT_TRUE(position) << radius;
                square += (*position - spot.centre).squaredNorm();
            }
            const double bound = cramer_rao_bound(camera, {place(0), 0.01 * radius, 1.0});
            const double ratio = std::sqrt(square / (2 * images)) / bound;
            EXPECT_LT(ratio, 1.1) << "radius " << radius << " read noise " << read_noise;
            EXPECT_GT(ratio, 0.9) << "radius " << radius << " read noise " << read_noise;
        }
}

TEST(CramerRaoBound, OfALargeSpotInTheDarkIsAQuarterOfItsDiameterOverTheRootOfItsElectrons) {
    Camera camera = camera_for(20.0, 1e4);
    camera.shot_noise = true;
    // A pixel adds 1/12 to the variance of an electron's place, r^2/4 = 100: 4e-4 of the bound.
    EXPECT_NEAR(cramer_rao_bound(camera, {{0.0, 0.0}, 0.2, 1.0}) / (0.2 / 2.0 / 100.0), 1.0, 1e-3);
    EXPECT_EQ(cramer_rao_bound(camera_for(5.0, 1e4), {{0.0, 0.0}, 0.05, 1.0}), 0.0);  // no noise
    EXPECT_EQ(cramer_rao_bound(camera, {{99.0, 0.0}, 0.2, 1.0}), std::numeric_limits<double>::infinity());
}

TEST(CramerRaoBound, APixelTellsMoreThanItsVarianceAndLessThanItsElectronsCounted) {
    for (const double sigma : {0.05, 0.3, 1.0, 3.0, 20.0}) {
        const stepdiag::PixelInformation of_pixel(true, sigma * sigma);
        for (const double mean : {1e-5, 1e-3, 0.1, 2.0, 50.0, 99.0, 101.0, 1e5}) {
            EXPECT_GE(of_pixel(mean) * (mean + sigma * sigma), 1.0 - 1e-6);  // the trapezoidal rule
            EXPECT_LE(of_pixel(mean) * mean, 1.0 + 1e-6);
        }
        // In the dark, the next electron against none: exp(1/sigma^2) - 1.
        if (sigma >= 1.0) {
            EXPECT_NEAR(of_pixel(0.0) / (std::exp(1.0 / (sigma * sigma)) - 1.0), 1.0, 1e-3);  // 1e-4 electrons
        }
    }
    EXPECT_EQ(stepdiag::PixelInformation(false, 4.0)(7.0), 0.25);
}

TEST(CramerRaoBound, IsTheInverseOfTheInformationByDifferences) {
    Camera camera = camera_for(3.0, 5000.0);
    camera.background = 2.0;
    camera.shot_noise = true;
    camera.read_noise = 1.5;
    camera.full_well = 4000.0;
    camera.bits = 10;
    const BeamSpot spot{{0.003, -0.002}, 0.03, 0.8};
    const auto mean = [&](int parameter, double change) {
        Camera c;
        c.columns = camera.columns, c.rows = camera.rows;
        c.electrons = camera.electrons, c.background = camera.background;
        BeamSpot s = spot;
        if (parameter < 2) s.centre[parameter] += change;
        if (parameter == 2) s.radius += change;
        if (parameter == 3) s.power += change;
        if (parameter == 4) c.background += change;
        return expose(c, {s}, 0, 0);
    };
    const double step = 4000.0 / 1023.0;
    const stepdiag::PixelInformation of_pixel(true, 1.5 * 1.5 + step * step / 12.0);
    const Eigen::ArrayXXd weight = mean(0, 0.0).array().unaryExpr(of_pixel);
    Eigen::Matrix<double, 5, 5> information;
    const auto derivative = [&](int i) {
        const double h = i < 3 ? 1e-6 : 1e-4;
        return ((mean(i, h) - mean(i, -h)) / (2.0 * h)).array().eval();
    };
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) information(i, j) = (derivative(i) * derivative(j) * weight).sum();
    const double expected = std::sqrt(information.inverse()(0, 0));
    EXPECT_NEAR(cramer_rao_bound(camera, spot) / expected, 1.0, 1e-6);  // differences: (h / radius)^2, and roundings
}

TEST(Centroid, SpotCutByTheEdgeIsStillFoundByTheFit) {
    Camera camera = camera_for(8.0, 1e6);
    const double edge = 0.01 * camera.columns / 2.0;
    for (const double beyond : {-0.16, -0.08, -0.04}) {  // two radii to half a radius inside
        const BeamSpot spot{{edge + beyond, 0.013}, 0.08, 1.0};
        const auto position = locate(camera, expose(camera, {spot}, 0, 0));
        ASSERT_TRUE(position);
        EXPECT_LT((*position - spot.centre).norm() / 0.01, 1e-6);
    }
    EXPECT_FALSE(locate(camera, expose(camera, {{{edge + 0.02, 0.0}, 0.08, 1.0}}, 0, 0)));  // its centre is not seen
}

TEST(Centroid, SaturatedPixelsAreLeftOutOfTheFit) {
    Camera camera = camera_for(8.0, 1e6);
    const BeamSpot spot{{0.0131, -0.0217}, 0.08, 1.0};
    camera.full_well = 0.4 * expose(camera, {spot}, 0, 0).maxCoeff();
    EXPECT_LT((*locate(camera, expose(camera, {spot}, 0, 0)) - spot.centre).norm() / 0.01, 1e-6);

    camera.shot_noise = true;
    camera.read_noise = 10.0;
    camera.bits = 12;
    Vector2d mean = Vector2d::Zero();
    for (int i = 0; i < 100; ++i) mean += (*locate(camera, expose(camera, {spot}, 4, i)) - spot.centre) / 100.0;
    EXPECT_LT(mean.norm() / 0.01, 0.01);  // noise leaves 0.005 pixels of one image, 0.0005 of a hundred
}

TEST(Centroid, ConvertersStepsLeaveNoBias) {
    Camera camera = camera_for(4.0, 1e5);
    camera.full_well = 5000.0;
    camera.bits = 8;
    camera.background = 100.0;
    camera.read_noise = 15.0;
    camera.shot_noise = true;
    Vector2d mean = Vector2d::Zero();
    constexpr int images = 400;
    for (int i = 0; i < images; ++i) {
        const BeamSpot spot{place(i), 0.04, 1.0};
        mean += (*locate(camera, expose(camera, {spot}, 4, i)) - spot.centre) / images;
    }
    EXPECT_LT(mean.norm() / 0.01, 0.01);  // one image has 0.02 pixels of noise
}

TEST(Centroid, NothingIsLocatedInTheDark) {
    for (const auto centroid : {Centroid::gaussian_fit, Centroid::centre_of_gravity}) {
        Camera camera = camera_for(5.0, 1e6);
        camera.centroid = centroid;
        EXPECT_FALSE(locate(camera, expose(camera, {}, 0, 0)));
        EXPECT_FALSE(locate(camera, expose(camera, {{{9.0, 0.0}, 0.05, 1.0}}, 0, 0)));
        EXPECT_FALSE(locate(camera, expose(camera, {{{0.0, 0.0}, 0.05, 1e-7}}, 0, 0)));  // a tenth of an electron
        camera.background = 50.0;
        camera.read_noise = 3.0;
        camera.shot_noise = true;
        for (int i = 0; i < 200; ++i) EXPECT_FALSE(locate(camera, expose(camera, {}, 1, i)));
    }
}

TEST(Centroid, FitFindsASpotThatNoPixelShows) {
    Camera camera;  // 2 electrons a pixel of signal at most, over a noise of 3, in 512 x 512 pixels
    camera.electrons = 1300.0;
    camera.read_noise = 3.0;
    camera.shot_noise = true;
    const BeamSpot spot{{1.1, -0.7}, 0.2, 1.0};
    const double bound = cramer_rao_bound(camera, spot);
    int found = 0;
    for (int i = 0; i < 20; ++i) {
        const auto position = locate(camera, expose(camera, {spot}, 2, i));
        if (!position) continue;
        ++found;
        EXPECT_LT((*position - spot.centre).norm(), 6.0 * bound);
    }
    EXPECT_GE(found, 19);
}

TEST(Centroid, WeakGhostShiftsTheFitByLessThanItsShare) {
    Camera camera = camera_for(8.0, 1e6);
    const BeamSpot spot{{0.0, 0.0}, 0.08, 1.0}, ghost{{0.15, 0.0}, 0.08, 1e-3};
    const auto position = *locate(camera, expose(camera, {spot, ghost}, 0, 0));
    EXPECT_GT(position.x(), 0.0);
    EXPECT_LT(position.x(), 1e-3 * 0.15);
}
