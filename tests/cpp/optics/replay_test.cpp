#include "stepdiag/optics/replay.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "optics/recorded_route.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/rotation.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Encounter;
using stepdiag::Event;
using stepdiag::Face;
using stepdiag::make_rectangle;
using stepdiag::Medium;
using stepdiag::Path;
using stepdiag::PathEnd;
using stepdiag::Ray;
using stepdiag::Scene;
using stepdiag::Surface;

constexpr double pi = 3.14159265358979323846;
const double nan = std::numeric_limits<double>::quiet_NaN();

Matrix3d turned(double x, double y, double z) { return stepdiag::rotation_exp({x, y, z}); }

void add(std::vector<Face>& faces, const std::vector<Face>& more) {
    faces.insert(faces.end(), more.begin(), more.end());
}

// Through a plate and a wedge, by a right-angle prism to a mirror and back the same way; all a little out of place.
struct Bench {
    Medium air{1.00027}, glass{1.5009};
    Ray ray{{0, 0, 0}, {0, 0, 1}};
    Scene scene;

    explicit Bench(double size = 1.0, unsigned seed = 1) : scene(faces(size, seed)) {}

    std::vector<Face> faces(double size, unsigned seed) const {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> turn(-0.01 * size, 0.01 * size);
        const auto rotation = [&](double about_y) {
            const double x = turn(random), y = turn(random), z = turn(random);
            return Matrix3d(turned(x, y, z) * turned(0, about_y, 0));
        };
        std::vector<Face> faces;
        add(faces, make_plate(40, 40, 6, glass, {{0, 0, 60}, rotation(0)}));
        add(faces, make_wedge(40, 40, 8, 0.01, glass, {{0, 0, 120}, rotation(0)}));
        // Legs square to z and x, the hypotenuse turns z into x.
        add(faces, make_prism(60, 60, 0.5 * pi, glass, {{-1, 0, 201}, rotation(0.75 * pi)}));
        faces.push_back(make_rectangle({700, 0, 200}, rotation(0.5 * pi), {200, 200}, Surface::reflecting));
        faces.push_back(make_rectangle({0, 0, -50}, rotation(0), {500, 500}, Surface::absorbing));
        return faces;
    }
    Path path() const { return trace(scene, air, ray); }
    RecordedRoute record() const { return RecordedRoute(scene, air, ray, path()); }
};

}  // namespace

TEST(Replay, IsTheTraceToRounding) {
    int absorbed = 0;
    for (unsigned seed = 1; seed <= 100; ++seed) {
        const Bench bench(1.0, seed);
        const Path path = bench.path();
        absorbed += path.end == PathEnd::absorbed;
        ASSERT_GE(path.hits.size(), 4u);
        RayLanes lanes(5, bench.ray);
        lanes.follow(bench.record().route, bench.scene.self_intersection_gap());
        for (std::size_t i = 0; i < lanes.lanes(); ++i) {
            ASSERT_EQ(lanes.followed[i], 1) << "seed " << seed;
            // A dozen planes at 1000 mm, each with some roundings of 1e-13; the beam turns by roundings of 1e-16.
            ASSERT_NEAR(lanes.end[6][i], path.optical_length, 5e-12) << "seed " << seed;
            ASSERT_LE((lanes.point(i) - path.hits.back().point).norm(), 1e-11);
            ASSERT_LE((lanes.direction(i) - path.direction).norm(), 1e-14);
        }
    }
    EXPECT_GE(absorbed, 50);
}
