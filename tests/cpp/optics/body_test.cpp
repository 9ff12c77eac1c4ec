#include "stepdiag/optics/body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "optics/usual_media.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/ray_tree.hpp"
#include "support/refuses.hpp"

namespace {

using namespace stepdiag;
using Eigen::Vector3d;
using stepdiag::test::air;
using stepdiag::test::direction_rounding;
using stepdiag::test::glass;
using stepdiag::test::length_rounding;

Ray ray_at(double incidence, const Vector3d& through, double before) {
    const Vector3d direction(std::sin(incidence), 0.0, std::cos(incidence));
    return {through - before * direction, direction};
}

TEST(Refract, SinesAreInTheRatioOfTheIndices) {
    for (const double angle : {0.0, 1e-9, 1e-3, 0.3, 1.0, 1.5}) {
        const Vector3d direction(std::sin(angle), 0.0, -std::cos(angle));
        const auto refracted = refract(direction, Vector3d::UnitZ(), 1.0 / 1.5);
        ASSERT_TRUE(refracted);
        EXPECT_NEAR(refracted->norm(), 1.0, direction_rounding);
        EXPECT_NEAR(refracted->x(), std::sin(angle) / 1.5, direction_rounding);
        EXPECT_EQ(refracted->y(), 0.0);
        // The same face seen from behind, and the way back.
        EXPECT_EQ(*refract(direction, -Vector3d::UnitZ(), 1.0 / 1.5), *refracted);
        EXPECT_LT((*refract(-*refracted, Vector3d::UnitZ(), 1.5) + direction).norm(), direction_rounding);
    }
}

TEST(Refract, BeyondTheCriticalAngleThereIsNone) {
    const double critical = std::asin(1.0 / 1.5);
    const auto leave = [](double angle) {
        return refract(Vector3d(std::sin(angle), 0.0, std::cos(angle)), Vector3d::UnitZ(), 1.5);
    };
    EXPECT_TRUE(leave(critical - 1e-9));
    EXPECT_FALSE(leave(critical + 1e-9));
    EXPECT_FALSE(leave(std::nan("")));
}

TEST(Plate, DisplacesAndDoesNotTurn) {
    const double thickness = 10.0;
    const Scene scene(make_plate(80.0, 80.0, thickness, glass));
    for (const double angle : {0.0, 1e-4, 0.1, 0.7}) {
        const Ray ray = ray_at(angle, {0.0, 0.0, -0.5 * thickness}, 20.0);
        const Path path = trace(scene, air, ray);
        ASSERT_EQ(path.events, (std::vector<Event>{Event::refracted, Event::refracted}));
        EXPECT_EQ(path.end, PathEnd::missed);
        EXPECT_LT((path.direction - ray.direction).norm(), direction_rounding);
        const double n = glass.index / air.index, root = std::sqrt(n * n - std::sin(angle) * std::sin(angle));
        const Vector3d across = Vector3d(std::cos(angle), 0.0, -std::sin(angle));
        // Textbook: d sin(theta) (1 - cos(theta)/sqrt(n^2 - sin^2(theta))), towards the normal's side.
        EXPECT_NEAR((path.hits.back().point - ray.origin).dot(across),
                    -thickness * std::sin(angle) * (1.0 - std::cos(angle) / root), length_rounding);
        EXPECT_NEAR(path.optical_length, air.index * 20.0 + glass.index * thickness * n / root, length_rounding);
    }
}

TEST(Wedge, TurnsByItsClosedForm) {
    const double angle = pi / 180.0;
    const Scene scene(make_wedge(40.0, 40.0, 8.0, angle, glass));
    const Path path = trace(scene, air, {{3.0, 1.0, -50.0}, Vector3d::UnitZ()});
    ASSERT_EQ(path.events.size(), 2u);
    // Square through the first face; the second, turned by `angle`, makes asin(n sin) of it, towards the thick side.
    const double turned = std::asin(glass.index / air.index * std::sin(angle)) - angle;
    EXPECT_NEAR(path.direction.x(), std::sin(turned), direction_rounding);
    EXPECT_NEAR(path.direction.z(), std::cos(turned), direction_rounding);
}

TEST(Prism, DeviatesLeastByItsClosedForm) {
    const double apex = pi / 3.0, side = 30.0;
    const Scene scene(make_prism(side, 30.0, apex, glass));
    const double least = 2.0 * std::asin(glass.index / air.index * std::sin(0.5 * apex)) - apex;
    const auto deviation = [&](double turn) {
        const Vector3d middle(-0.5 * side * std::sin(0.5 * apex), 0.0, 0.5 * side * std::cos(0.5 * apex));
        const double rise =
            0.5 * least + turn;  // at least deviation light runs level inside, so it comes in from below
        const Vector3d direction(std::cos(rise), 0.0, std::sin(rise));
        const Path path = trace(scene, air, {middle - 40.0 * direction, direction});
        EXPECT_EQ(path.events.size(), 2u);
        return std::atan2(direction.cross(path.direction).norm(), direction.dot(path.direction));
    };
    EXPECT_NEAR(deviation(0.0), least, direction_rounding);
    EXPECT_GT(deviation(0.01), least);
    EXPECT_GT(deviation(-0.01), least);
}

TEST(Prism, RightAngleTurnsLightBackByTotalReflection) {
    const auto back = [](Medium medium) {
        const Scene scene(make_prism(30.0, 30.0, 0.5 * pi, medium));
        return trace(scene, {1.0}, {{5.0, 1.0, -40.0}, Vector3d::UnitZ()});
    };
    const Path path = back(glass);
    const std::vector<Event> expected = {Event::refracted, Event::totally_reflected, Event::totally_reflected,
                                         Event::refracted};
    EXPECT_EQ(path.events, expected);
    EXPECT_LT((path.direction + Vector3d::UnitZ()).norm(), direction_rounding);
    EXPECT_NEAR(path.hits.back().point.x(), -5.0, length_rounding);
    EXPECT_EQ(back({1.3}).events[1], Event::refracted);  // 45 degrees are below the critical angle of 50.3
}

TEST(CornerCube, SendsLightBackAntiparallelWhereverItPoints) {
    const Vector3d tilt(0.3, -0.2, 0.7);
    const Placement placement{{10.0, -20.0, 300.0}, rotation_exp(tilt)};
    const Scene scene(make_corner_cube(25.0, glass, placement));
    for (const Vector3d& aim : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.05, -0.02, 0.0), Vector3d(-0.1, 0.08, 0.3)}) {
        const Vector3d direction = placement.rotation * rotation_exp(aim) * Vector3d(0.0, 0.0, -1.0);
        const Vector3d entry = placement.position + placement.rotation * Vector3d(3.0, 2.0, 25.0);
        const Path path = trace(scene, air, {entry - 100.0 * direction, direction});
        ASSERT_EQ(path.events.size(), 5u);
        EXPECT_EQ(path.events.front(), Event::refracted);
        EXPECT_EQ(path.events.back(), Event::refracted);
        EXPECT_LT((path.direction + direction).norm(), direction_rounding);
    }
}

TEST(CubeSplitter, SendsLightStraightOnAndAtRightAngles) {
    // Along +z to +x, along -z to -x; every way through is one edge of glass.
    const double edge = 20.0;
    const Scene scene(make_cube_splitter(edge, glass, 0.4));
    for (const double along : {1.0, -1.0}) {
        const Vector3d z = along * Vector3d::UnitZ(), x = along * Vector3d::UnitX();
        const Vector3d aim(3.0, -4.0, 0.0);
        const RayTree tree = trace_tree(scene, air, {aim - 50.0 * z, z});
        // Source, up to the splitting face, two ways on, and outside.
        ASSERT_EQ(tree.segments.size(), 6u);
        for (const Segment& out : tree.segments) {
            if (out.end != SegmentEnd::left) continue;
            const bool is_reflected = std::abs(out.ray.direction.x()) > 0.5;
            EXPECT_EQ(out.power, is_reflected ? 0.4 : 0.6);
            EXPECT_LT((out.ray.direction - (is_reflected ? x : z)).norm(), direction_rounding);
            // The splitting face is met at z = x: the reflected beam leaves at that height.
            const Vector3d leaves =
                is_reflected ? Vector3d(0.0, aim.y(), aim.x()) + 0.5 * edge * x : aim + 0.5 * edge * z;
            EXPECT_LT((out.ray.origin - leaves).norm(), length_rounding);
            const Path path = tree.path_to(int(&out - tree.segments.data()));
            EXPECT_NEAR(path.optical_length, air.index * (50.0 - 0.5 * edge) + glass.index * edge, length_rounding);
        }
    }
}

TEST(CubeSplitter, TurnedByAnAngleTurnsTheReflectedBeamByTwiceIt) {
    // Turned about y, in the plane of incidence. The reflected path through the cube, unfolded at the splitting face,
    // is one through a plane plate, whichever way the cube stands: refraction turns nothing.
    const Ray ray{{1.0, 2.0, -50.0}, Vector3d::UnitZ()};
    for (const double turn : {1e-6, 1e-3, -0.1, 0.2}) {
        const Scene scene(make_cube_splitter(20.0, glass, 0.5, 0.0, {{0.5, 0.0, 3.0}, rotation_exp({0.0, turn, 0.0})}));
        const RayTree tree = trace_tree(scene, air, ray);
        int left = 0;
        for (const Segment& out : tree.segments) {
            if (out.end != SegmentEnd::left) continue;
            ++left;
            const bool is_reflected = out.ray.direction.x() > 0.5;
            const Vector3d expected =
                is_reflected ? Vector3d(std::cos(2.0 * turn), 0.0, -std::sin(2.0 * turn)) : Vector3d(Vector3d::UnitZ());
            EXPECT_LT((out.ray.direction - expected).norm(), direction_rounding) << turn;
        }
        EXPECT_EQ(left, 2);
    }
}

TEST(CubeSplitter, NoRaySlipsPastTheSplittingFaceInsideItsMargin) {
    // A grid right up to the margin of 1e-4 edges: each ray is split once, and none is lost at the cube's edges.
    const double edge = 20.0, clear = (0.5 - 1.2e-4) * edge;
    const Placement placement{{400.0, -300.0, 250.0}, rotation_exp({0.3, 0.2, -0.4})};
    const Scene scene(make_cube_splitter(edge, glass, 0.5, 0.0, placement));
    constexpr int n = 40;
    for (int i = -n; i <= n; ++i)
        for (int k = -n; k <= n; ++k) {
            const Vector3d aim(clear * i / n, clear * k / n, -30.0);
            const RayTree tree =
                trace_tree(scene, air, {placement.position + placement.rotation * aim, placement.rotation.col(2)});
            ASSERT_EQ(tree.segments.size(), 6u) << aim.transpose();
            EXPECT_EQ(tree.left, 1.0);
        }
    // In the margin it goes straight on.
    const Vector3d aim(0.5 * edge * (1.0 - 1e-4), 0.0, -30.0);
    EXPECT_EQ(trace_tree(scene, air, {placement.position + placement.rotation * aim, placement.rotation.col(2)})
                  .segments.size(),
              3u);
}

TEST(Placed, FacesStandWhereTheirBodyIsMadeThere) {
    const Placement placement{{10.0, -20.0, 300.0}, rotation_exp({0.3, -0.2, 0.7})};
    const auto moved = placed(make_wedge(20.0, 30.0, 5.0, 0.1, glass), placement);
    const auto made = make_wedge(20.0, 30.0, 5.0, 0.1, glass, placement);
    ASSERT_EQ(moved.size(), made.size());
    for (std::size_t f = 0; f < made.size(); ++f) {
        EXPECT_LT((moved[f].point - made[f].point).norm(), length_rounding);
        EXPECT_LT((moved[f].normal - made[f].normal).norm(), direction_rounding);
        for (std::size_t k = 0; k < made[f].outline.size(); ++k)
            EXPECT_LT((moved[f].outline[k] - made[f].outline[k]).norm(), length_rounding);
        EXPECT_EQ(moved[f].behind.index, glass.index);
    }
}

TEST(Body, WhatIsNoConvexBodyIsRefusedByName) {
    const std::vector<Vector3d> cube = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                        {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const std::vector<std::vector<int>> sides = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                 {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    EXPECT_EQ(make_body(cube, sides, glass).size(), 6u);
    const auto changed = [&](auto change) {
        auto corners = cube;
        auto faces = sides;
        change(corners, faces);
        make_body(corners, faces, glass);
    };
    expect_refused([&] { changed([](auto&, auto& f) { f.pop_back(); }); }, "not closed");
    expect_refused([&] { changed([](auto&, auto& f) { f.resize(2); }); }, "four faces");
    expect_refused([&] { changed([](auto&, auto& f) { f[2] = {0, 1, 9, 4}; }); }, "no corner 9");
    expect_refused([&] { changed([](auto&, auto& f) { f[1] = {4, 5}; }); }, "three corners");
    expect_refused([&] { changed([](auto& c, auto&) { c[6].z() = 1.1; }); }, "not planar");
    expect_refused([&] { changed([](auto& c, auto&) { c[6].x() = std::nan(""); }); }, "finite");
    expect_refused([&] { changed([](auto& c, auto&) { c[1] = c[2] = c[0]; }); }, "no area");
    expect_refused([&] { make_body(cube, sides, {0.5}); }, "index");
    // A roof turned inside out: planar and closed, with a dent.
    const std::vector<Vector3d> dented = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 4},
                                          {4, 0, 4}, {4, 4, 4}, {0, 4, 4}, {2, 2, 3}};
    expect_refused(
        [&] {
            make_body(dented,
                      {{0, 1, 2, 3},
                       {0, 1, 5, 4},
                       {1, 2, 6, 5},
                       {2, 3, 7, 6},
                       {3, 0, 4, 7},
                       {4, 5, 8},
                       {5, 6, 8},
                       {6, 7, 8},
                       {7, 4, 8}},
                      glass);
        },
        "not convex");
    expect_refused([] { make_plate(0.0, 1.0, 1.0, glass); }, "width");
    expect_refused([] { make_wedge(10.0, 10.0, 1.0, 0.5, glass); }, "wedge angle");
    expect_refused([] { make_prism(10.0, 10.0, 4.0, glass); }, "apex");
    expect_refused([] { make_corner_cube(-1.0, glass); }, "depth");
    expect_refused([] { make_cube_splitter(0.0, glass); }, "edge");
    expect_refused([] { make_cube_splitter(10.0, glass, 0.7, 0.4); }, "together");
    expect_refused([] { make_cube_splitter(10.0, glass, -0.1); }, "reflectance");
    expect_refused([] { make_mirror(10.0, std::nan("")); }, "height");
    expect_refused([] { make_mirror(10.0, 10.0, 1.1); }, "reflectance");
    expect_refused([] { make_screen(-1.0, 10.0); }, "width");
    expect_refused([&] { make_body(cube, std::vector<std::vector<int>>(1'000'000, sides[0]), glass); }, "20000");
}

}  // namespace
