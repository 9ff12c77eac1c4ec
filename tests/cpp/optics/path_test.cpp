#include "stepdiag/optics/path.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "stepdiag/core/rotation.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::make_rectangle;
using stepdiag::Medium;
using stepdiag::PathEnd;
using stepdiag::Scene;
using stepdiag::Surface;

const double quarter = std::acos(-1.0) / 4.0;

Matrix3d about_y(double angle) { return stepdiag::rotation_exp({0.0, angle, 0.0}); }

}  // namespace

TEST(Path, BeamGoesToTheMirrorAndBack) {
    const Scene scene({make_rectangle({0, 0, 750}, Matrix3d::Identity(), {50, 50}, Surface::reflecting),
                       make_rectangle({0, 0, 0}, Matrix3d::Identity(), {50, 50}, Surface::absorbing)});
    const auto path = trace(scene, Medium{1.0}, {{0, 0, 0}, {0, 0, 1}});
    EXPECT_EQ(path.end, PathEnd::absorbed);
    ASSERT_EQ(path.hits.size(), 2u);
    EXPECT_EQ(path.geometric_length, 1500.0);
    EXPECT_EQ(path.direction, Vector3d(0, 0, -1));
}

TEST(Path, PeriscopeOfTwoMirrorsShiftsTheBeam) {
    // Two parallel mirrors at 45 degrees: along z, then 200 mm along x, then along z again.
    const Scene scene({make_rectangle({0, 0, 300}, about_y(-quarter), {60, 60}, Surface::reflecting),
                       make_rectangle({200, 0, 300}, about_y(-quarter), {60, 60}, Surface::reflecting),
                       make_rectangle({200, 0, 1000}, Matrix3d::Identity(), {60, 60}, Surface::absorbing)});
    const auto path = trace(scene, Medium{1.0}, {{0, 0, 0}, {0, 0, 1}});
    EXPECT_EQ(path.end, PathEnd::absorbed);
    ASSERT_EQ(path.hits.size(), 3u);
    // The mirrors' normals are rounded to 1e-16, which turns the beam by as much over 1200 mm.
    EXPECT_NEAR(path.geometric_length, 300.0 + 200.0 + 700.0, 1e-12);
    EXPECT_LE((path.hits[2].point - Vector3d(200, 0, 1000)).norm(), 1e-12);
    EXPECT_LE((path.direction - Vector3d(0, 0, 1)).norm(), 1e-15);
}

TEST(Path, CornerReflectorSendsEveryBeamBackParallel) {
    // Three mirrors at right angles: direction reversed; and the way is twice the distance to the corner's plane.
    std::vector<stepdiag::Face> faces;
    const Matrix3d turn = stepdiag::rotation_exp({0.3, -0.2, 0.5});
    const Vector3d corner = turn * Vector3d(0, 0, 800);
    for (int axis = 0; axis < 3; ++axis) {
        Matrix3d frame;
        frame << turn.col((axis + 1) % 3), turn.col((axis + 2) % 3), turn.col(axis);
        faces.push_back(make_rectangle(corner, frame, {400, 400}, Surface::reflecting));
    }
    const Scene scene(faces);
    const Vector3d axis = turn * Vector3d(1, 1, 1).normalized();
    for (const Vector3d& skew : {Vector3d(0.05, 0.01, -0.02), Vector3d(-0.1, 0.08, 0.03), Vector3d(0.0, 0.02, -0.11)}) {
        const Vector3d direction = (axis + skew).normalized();
        const Vector3d origin = corner - 500.0 * axis + turn * Vector3d(3.0, -5.0, 1.0);
        const auto path = trace(scene, Medium{1.0}, {origin, direction});
        EXPECT_EQ(path.end, PathEnd::missed);
        ASSERT_EQ(path.hits.size(), 3u);
        EXPECT_LE((path.direction + direction).norm(), 1e-15);  // three reflections, a rounding each
        const double to_corner_plane = (corner - origin).dot(direction);
        const double back = (path.hits[2].point - origin).dot(-direction);  // from the last hit to the start's plane
        EXPECT_NEAR(path.geometric_length - back, 2.0 * to_corner_plane, 2e-12);  // roundings of 1000 mm
    }
}

TEST(Path, TwoFacingMirrorsGiveTooManyHits) {
    const Scene scene({make_rectangle({0, 0, 0}, Matrix3d::Identity(), {50, 50}, Surface::reflecting),
                       make_rectangle({0, 0, 10}, Matrix3d::Identity(), {50, 50}, Surface::reflecting)});
    for (const int most : {1, 7, 64}) {
        const auto path = trace(scene, Medium{1.0}, {{0, 0, 5}, {0, 0, 1}}, most);
        EXPECT_EQ(path.end, PathEnd::too_many_hits);
        EXPECT_EQ(path.hits.size(), std::size_t(most));
        EXPECT_EQ(path.geometric_length, 10.0 * most - 5.0);
    }
}

TEST(Path, MissKeepsWhatWasMetBefore) {
    const Scene scene({make_rectangle({0, 0, 300}, about_y(0.1), {60, 60}, Surface::reflecting)});
    const auto path = trace(scene, Medium{1.0}, {{0, 0, 0}, {0, 0, 1}});
    EXPECT_EQ(path.end, PathEnd::missed);
    EXPECT_EQ(path.hits.size(), 1u);
    EXPECT_NEAR(path.geometric_length, 300.0, 1e-13);
    EXPECT_LE((path.direction - about_y(0.2) * Vector3d(0, 0, -1)).norm(), 1e-15);
}

TEST(Path, OpticalLengthIsIndexTimesGeometricLength) {
    const Scene scene({make_rectangle({0, 0, 750}, about_y(1e-3), {50, 50}, Surface::reflecting),
                       make_rectangle({0, 0, 0}, Matrix3d::Identity(), {50, 50}, Surface::absorbing)});
    for (const double index : {1.0, 1.000268, 1.5}) {
        const auto path = trace(scene, Medium{index}, {{0, 0, 0}, {0, 0, 1}});
        EXPECT_NEAR(path.optical_length, index * path.geometric_length, 1e-12);  // two products and a sum near 2000 mm
    }
}

TEST(Path, ReflectionKeepsTheAngleAndTheLength) {
    const Vector3d d = Vector3d(0.3, -0.5, 0.8).normalized(), n = Vector3d(-0.1, 0.7, 0.2).normalized();
    const Vector3d r = stepdiag::reflect(d, n);
    EXPECT_NEAR(r.norm(), 1.0, 5e-16);
    EXPECT_NEAR(r.dot(n), -d.dot(n), 5e-16);
    EXPECT_LE((r.cross(n) - d.cross(n)).norm(), 5e-16);  // the part along the mirror stays
    EXPECT_EQ(stepdiag::reflect(d, -n), r);              // either side
}
