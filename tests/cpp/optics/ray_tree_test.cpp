#include "stepdiag/optics/ray_tree.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "optics/usual_media.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "support/refuses.hpp"

namespace {

using namespace stepdiag;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::test::air;
using stepdiag::test::direction_rounding;
using stepdiag::test::glass;
using stepdiag::test::length_rounding;

// Sums of up to thousands of shares, each rounded to 1e-16 of the source's power.
constexpr double power_rounding = 1e-12;

void append(std::vector<Face>& faces, const std::vector<Face>& more) {
    faces.insert(faces.end(), more.begin(), more.end());
}

Face splitting_face(double reflectance, double absorptance, Medium behind = {}) {
    Face face = make_rectangle(Vector3d::Zero(), Matrix3d::Identity(), {40.0, 40.0}, Surface::splitting);
    face.reflectance = reflectance;
    face.absorptance = absorptance;
    face.behind = behind;
    return face;
}

double power_of_leaves(const RayTree& tree, SegmentEnd end) {
    double power = 0.0;
    for (const Segment& segment : tree.segments)
        if (segment.end == end) power += segment.power;
    return power;
}

}  // namespace

TEST(RayTree, SplittingFaceSendsLightBothWays) {
    const Scene scene({splitting_face(0.3, 0.2, glass)});
    const Vector3d down(0.6, 0.0, -0.8);
    const RayTree tree = trace_tree(scene, air, {Vector3d(0.0, 0.0, 10.0), down});
    ASSERT_EQ(tree.segments.size(), 3u);
    const Segment& on = tree.segments[1];
    const Segment& back = tree.segments[2];
    EXPECT_EQ(tree.segments[0].end, SegmentEnd::goes_on);
    EXPECT_EQ(*on.event, Event::refracted);
    EXPECT_EQ(*back.event, Event::reflected);
    EXPECT_DOUBLE_EQ(on.power, 0.5);
    EXPECT_EQ(back.power, 0.3);
    EXPECT_EQ(tree.absorbed, 0.2);
    EXPECT_EQ(on.index, glass.index);
    EXPECT_EQ(back.index, air.index);
    EXPECT_LT((on.ray.direction - *refract(down, Vector3d::UnitZ(), air.index / glass.index)).norm(),
              direction_rounding);
    EXPECT_LT((back.ray.direction - Vector3d(0.6, 0.0, 0.8)).norm(), direction_rounding);
}

TEST(RayTree, MediumInFrontOfAFaceIsHonoured) {
    Face face = splitting_face(0.5, 0.0, glass);
    face.before = glass;
    const Vector3d down(0.6, 0.0, -0.8);
    for (const double side : {1.0, -1.0}) {
        const Vector3d direction = side * down;
        const RayTree tree = trace_tree(Scene({face}), air, {-10.0 * direction, direction});
        ASSERT_EQ(tree.segments.size(), 3u);
        EXPECT_LT((tree.segments[1].ray.direction - direction).norm(), direction_rounding);  // glass on both sides
        EXPECT_EQ(tree.segments[1].index, glass.index);
    }
    face.surface = Surface::refracting;
    face.behind = {1.2};
    const Path path = trace(Scene({face}), air, {-10.0 * down, down});
    EXPECT_NEAR(path.direction.x(), 0.6 * glass.index / 1.2, direction_rounding);
}

TEST(RayTree, BeyondTheCriticalAngleASplittingFaceReflectsWhatItDoesNotAbsorb) {
    const Scene scene({splitting_face(0.3, 0.1, glass)});
    const Vector3d up(0.8, 0.0, 0.6);  // from the glass at 53 degrees; the critical angle is 41
    const RayTree tree = trace_tree(scene, air, {-10.0 * up, up});
    ASSERT_EQ(tree.segments.size(), 2u);
    EXPECT_EQ(*tree.segments[1].event, Event::totally_reflected);
    EXPECT_EQ(tree.segments[1].power, 0.9);
    EXPECT_EQ(tree.absorbed, 0.1);
    EXPECT_LT((tree.segments[1].ray.direction - Vector3d(0.8, 0.0, -0.6)).norm(), direction_rounding);
}

TEST(RayTree, MirrorAbsorbsWhatItDoesNotReflect) {
    const Scene scene(make_mirror(10.0, 10.0, 0.9));
    const RayTree tree = trace_tree(scene, air, {{0, 0, -5}, {0, 0, 1}});
    ASSERT_EQ(tree.segments.size(), 2u);
    EXPECT_NEAR(tree.absorbed, 0.1, 1e-16);
    EXPECT_EQ(tree.left, 0.9);
    const RayTree black = trace_tree(Scene(make_mirror(10.0, 10.0, 0.0)), air, {{0, 0, -5}, {0, 0, 1}});
    ASSERT_EQ(black.segments.size(), 1u);
    EXPECT_EQ(black.segments[0].end, SegmentEnd::absorbed);
}

TEST(RayTree, SequentialTraceGoesOnThroughASplittingFace) {
    std::vector<Face> faces = make_cube_splitter(20.0, glass);
    append(faces, make_screen(30.0, 30.0, {{0.0, 0.0, 50.0}}));
    const Scene scene(faces);
    const Ray ray{{1.0, 2.0, -30.0}, Vector3d::UnitZ()};
    const Path path = trace(scene, air, ray);
    EXPECT_EQ(path.events, (std::vector<Event>{Event::refracted, Event::refracted, Event::refracted, Event::absorbed}));
    EXPECT_NEAR(path.optical_length, 60.0 * air.index + 20.0 * glass.index, length_rounding);
    EXPECT_NEAR(path.reduced_length, 60.0 / air.index + 20.0 / glass.index, length_rounding);

    // And the tree's transmitted path is that one to the last bit.
    const RayTree tree = trace_tree(scene, air, ray);
    ASSERT_EQ(tree.arrivals(7).size(), 1u);
    const Path same = tree.path_to(tree.arrivals(7).front());
    EXPECT_EQ(same.events, path.events);
    EXPECT_EQ(same.end, PathEnd::absorbed);
    EXPECT_EQ(same.optical_length, path.optical_length);
    EXPECT_EQ(same.reduced_length, path.reduced_length);
    EXPECT_EQ(same.geometric_length, path.geometric_length);
    EXPECT_EQ(same.hits.back().point, path.hits.back().point);
}

// Intensities of an etalon without interference: R, then (1-R)^2 R, (1-R)^2 R^3, ... back; (1-R)^2, (1-R)^2 R^2, ...
// on.
TEST(RayTree, GhostsOfACoatedPlateAreAPowerSeries) {
    const double R = 0.04, thickness = 10.0, angle = 0.1;
    std::vector<Face> faces = make_plate(80.0, 80.0, thickness, glass);
    for (Face& face : faces) {
        face.surface = Surface::splitting;
        face.reflectance = R;
    }
    const int front = int(faces.size()), behind = front + 1;
    append(faces, make_screen(200.0, 200.0, {{0.0, 0.0, -50.0}}));
    append(faces, make_screen(200.0, 200.0, {{0.0, 0.0, 50.0}}));
    const Vector3d direction(std::sin(angle), 0.0, std::cos(angle));
    const Vector3d entry(0.0, 0.0, -0.5 * thickness);
    TreeLimits limits;
    limits.least_power = 1e-14;
    const RayTree tree = trace_tree(Scene(faces), air, {entry - 40.0 * direction, direction}, limits);

    const auto back = tree.arrivals(front), on = tree.arrivals(behind);
    ASSERT_GE(back.size(), 5u);
    ASSERT_GE(on.size(), 5u);
    const double n = glass.index / air.index, inside = std::asin(std::sin(angle) / n);
    for (int k = 0; k < 5; ++k) {
        const double expected = k == 0 ? R : (1 - R) * (1 - R) * std::pow(R, 2 * k - 1);
        EXPECT_NEAR(tree.segments[back[k]].power, expected, 1e-15 * expected + 1e-17)
            << k;  // roundings of the products
        EXPECT_NEAR(tree.segments[on[k]].power, (1 - R) * (1 - R) * std::pow(R, 2 * k), 1e-15 * expected + 1e-16) << k;
        // Each order is displaced by another 2 d tan(inside), and comes later by another twice the way through.
        const Path path = tree.path_to(back[k]);
        const double height = 50.0 - 0.5 * thickness;
        EXPECT_NEAR(path.hits.back().point.x(), height * std::tan(angle) + 2.0 * k * thickness * std::tan(inside),
                    length_rounding);
        EXPECT_NEAR(
            path.optical_length,
            air.index * (40.0 + height / std::cos(angle)) + 2.0 * k * glass.index * thickness / std::cos(inside),
            length_rounding);
    }
    // Without losses the sums of both series are 1: R + (1-R)^2 R/(1-R^2) = 2R/(1+R).
    EXPECT_NEAR(tree.absorbed, 1.0, 1e-12);
    double reflected = 0.0;
    for (const int i : back) reflected += tree.segments[i].power;
    EXPECT_NEAR(reflected, 2.0 * R / (1.0 + R), 1e-13);  // what the limit cut
}

TEST(RayTree, PowersOfAllLeavesAddUpToTheSource) {
    std::mt19937_64 engine(11);
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(engine);
    };
    const auto place = [&] {
        return Placement{{uniform(-60.0, 60.0), uniform(-60.0, 60.0), uniform(-60.0, 60.0)},
                         rotation_exp({uniform(-2.0, 2.0), uniform(-2.0, 2.0), uniform(-2.0, 2.0)})};
    };
    std::size_t most = 0;
    for (int round = 0; round < 40; ++round) {
        std::vector<Face> faces;
        for (int i = 0; i < 6; ++i) {
            append(faces,
                   make_cube_splitter(uniform(10.0, 40.0), glass, uniform(0.0, 0.7), uniform(0.0, 0.3), place()));
            append(faces, make_mirror(60.0, 60.0, uniform(0.0, 1.0), place()));
            auto plate = make_plate(30.0, 30.0, 3.0, glass, place());
            for (Face& face : plate) {
                face.surface = Surface::splitting;
                face.reflectance = uniform(0.0, 0.5);
                face.absorptance = uniform(0.0, 0.01);
            }
            append(faces, plate);
        }
        const Scene scene(faces);
        for (const TreeLimits& limits :
             {TreeLimits{}, TreeLimits{4, 0.0, 100000}, TreeLimits{64, 0.0, 500}, TreeLimits{64, 1e-9, 1}}) {
            const RayTree tree = trace_tree(scene, air, {{0.0, 0.0, -150.0}, Vector3d::UnitZ()}, limits);
            EXPECT_NEAR(tree.absorbed + tree.left + tree.cut, 1.0, power_rounding);
            EXPECT_NEAR(tree.left, power_of_leaves(tree, SegmentEnd::left), power_rounding);
            EXPECT_NEAR(tree.cut, power_of_leaves(tree, SegmentEnd::cut), power_rounding);
            EXPECT_LE(int(tree.segments.size()), limits.most_segments);
            most = std::max(most, tree.segments.size());
            for (int i = 0; i < int(tree.segments.size()); ++i) {
                EXPECT_LT(tree.segments[i].parent, i);
                if (tree.segments[i].end == SegmentEnd::goes_on) continue;
                const Path path = tree.path_to(i);
                EXPECT_EQ(path.hits.size(), path.events.size());
                EXPECT_LE(int(path.hits.size()), limits.most_hits);
            }
        }
    }
    EXPECT_GT(most, 1000u);  // or the test has lost its point
}

TEST(RayTree, LimitsCutWhatIsWeakOrFarAndCountIt) {
    // Two half mirrors that face each other: half of what is left goes out at each.
    std::vector<Face> faces;
    for (const double z : {0.0, 10.0}) {
        faces.push_back(splitting_face(0.5, 0.0));
        faces.back() = placed({faces.back()}, {{0.0, 0.0, z}}).front();
    }
    const Scene scene(faces);
    const Ray ray{{0.0, 0.0, 5.0}, Vector3d::UnitZ()};
    TreeLimits few_hits;
    few_hits.most_hits = 3;
    const RayTree shallow = trace_tree(scene, {1.0}, ray, few_hits);
    EXPECT_EQ(shallow.left, 0.75);  // half, a quarter; what the third hit splits is not followed
    EXPECT_EQ(shallow.cut, 0.25);
    EXPECT_EQ(shallow.segments.size(), 7u);
    EXPECT_EQ(shallow.path_to(6).end, PathEnd::too_many_hits);
    EXPECT_EQ(shallow.path_to(6).hits.size(), 3u);

    TreeLimits strong;
    strong.least_power = 0.1;
    EXPECT_EQ(trace_tree(scene, {1.0}, ray, strong).cut, 0.125);
    TreeLimits small;
    small.most_segments = 4;  // room for one face's two ways, not for another's
    const RayTree pruned = trace_tree(scene, {1.0}, ray, small);
    EXPECT_EQ(pruned.segments.size(), 3u);
    EXPECT_EQ(pruned.left, 0.5);
    EXPECT_EQ(pruned.cut, 0.5);
}

TEST(RayTree, ArrivalsStandStrongestFirst) {
    std::vector<Face> faces = make_cube_splitter(20.0, glass, 0.3);
    append(faces, make_mirror(20.0, 20.0, 1.0, {{0.0, 0.0, 40.0}}));
    append(faces, make_screen(40.0, 40.0, {{0.0, 0.0, -40.0}}));
    const RayTree tree = trace_tree(Scene(faces), air, {{0.0, 0.0, -30.0}, Vector3d::UnitZ()});
    const auto arrivals = tree.arrivals(8);
    ASSERT_EQ(arrivals.size(), 1u);
    EXPECT_NEAR(tree.segments[arrivals[0]].power, 0.49, 1e-16);
    EXPECT_TRUE(tree.arrivals(0).empty());
}

TEST(RayTree, WhatMakesNoSenseIsRefusedByName) {
    const Scene scene({splitting_face(0.5, 0.0)});
    const Ray ray{{0.0, 0.0, 5.0}, -Vector3d::UnitZ()};
    expect_refused([&] { trace_tree(scene, air, ray, {0, 1e-6, 10}); }, "most_hits");
    expect_refused([&] { trace_tree(scene, air, ray, {10, std::nan(""), 10}); }, "least_power");
    expect_refused([&] { trace_tree(scene, air, ray, {10, 1e-6, 0}); }, "most_segments");
    const RayTree tree = trace_tree(scene, air, ray);
    expect_refused([&] { tree.path_to(3); }, "segment");
    expect_refused([&] { tree.path_to(0); }, "goes on");
}
