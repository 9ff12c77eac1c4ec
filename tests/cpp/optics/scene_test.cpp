#include "stepdiag/optics/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "stepdiag/core/rotation.hpp"
#include "support/refuses.hpp"
#include "support/sphere.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Face;
using stepdiag::make_rectangle;
using stepdiag::Scene;
using stepdiag::Surface;

Face mirror_at(double z, const Matrix3d& turn = Matrix3d::Identity()) {
    return make_rectangle({0.0, 0.0, z}, turn, {40.0, 20.0}, Surface::reflecting);
}

struct Random {
    std::mt19937_64 engine{5};
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
    Vector3d direction() {
        std::normal_distribution<double> normal;
        return Vector3d(normal(engine), normal(engine), normal(engine)).normalized();
    }
};

}  // namespace

TEST(Scene, RayMeetsTheNearestFace) {
    const Scene scene({mirror_at(500.0), mirror_at(300.0), mirror_at(-10.0)});
    const auto hit = scene.first_hit({{1.0, 2.0, 0.0}, {0.0, 0.0, 1.0}});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->face, 1);
    EXPECT_EQ(hit->distance, 300.0);
    EXPECT_EQ(hit->point, Vector3d(1.0, 2.0, 300.0));
    EXPECT_EQ(scene.first_hit({{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}})->face, 2);
}

TEST(Scene, RayThatMeetsNothingIsAMiss) {
    const Scene scene({mirror_at(300.0)});
    EXPECT_FALSE(scene.first_hit({{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}}));  // behind
    EXPECT_FALSE(scene.first_hit({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}));   // parallel
    EXPECT_FALSE(scene.first_hit({{20.1, 0.0, 0.0}, {0.0, 0.0, 1.0}}));  // beside it
    EXPECT_FALSE(scene.first_hit({{0.0, -10.1, 0.0}, {0.0, 0.0, 1.0}}));
    EXPECT_TRUE(scene.first_hit({{19.9, 9.9, 0.0}, {0.0, 0.0, 1.0}}));
    EXPECT_FALSE(Scene({}).first_hit({{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}));
    const Scene added = Scene({}).with({mirror_at(300.0)});
    EXPECT_TRUE(added.first_hit({{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}));
    EXPECT_FALSE(added.first_hit({{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}}));
    EXPECT_FALSE(added.first_hit({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}));
    EXPECT_FALSE(added.first_hit({{0.0, 0.0, 300.0}, {1.0, 0.0, 0.0}}));  // within its plane
    EXPECT_FALSE(added.first_hit({{20.1, 0.0, 0.0}, {0.0, 0.0, 1.0}}));
}

TEST(Scene, OutlineOfAPolygonIsRespected) {
    // A regular hexagon with corners at distance 10: its inner circle has the radius 8.66.
    Face hexagon{{0.0, 0.0, 50.0}, Vector3d::UnitZ(), {}, Surface::absorbing};
    const double third = std::acos(-1.0) / 3.0;
    for (int k = 0; k < 6; ++k)
        hexagon.outline.push_back({10.0 * std::cos(k * third), 10.0 * std::sin(k * third), 50.0});
    const Scene scene({hexagon});
    Random random;
    for (int i = 0; i < 5000; ++i) {
        const Vector2d p(random.uniform(-11.0, 11.0), random.uniform(-11.0, 11.0));
        double beyond = -1e9;  // of the edges, whose normals point to (k + 1/2) * 60 degrees
        for (int k = 0; k < 6; ++k)
            beyond = std::max(beyond, p.x() * std::cos((k + 0.5) * third) + p.y() * std::sin((k + 0.5) * third) -
                                          10.0 * std::cos(third / 2));
        if (std::abs(beyond) < 1e-4) continue;  // the outline itself is known to single precision only
        EXPECT_EQ(scene.first_hit({{p.x(), p.y(), 0.0}, Vector3d::UnitZ()}).has_value(), beyond < 0.0) << p.transpose();
    }
}

TEST(Scene, HitIsThePointOfTheDoublePlane) {
    // Closed form: ray o + t d meets (x - c).n = 0. Single precision alone would be off by 1e-4 mm at 1 m.
    Random random;
    for (int i = 0; i < 2000; ++i) {
        const Matrix3d turn = stepdiag::rotation_exp(0.3 * random.direction());
        const Vector3d centre(random.uniform(-500.0, 500.0), random.uniform(-500.0, 500.0),
                              random.uniform(-500.0, 500.0));
        const Scene scene({make_rectangle(centre, turn, {40.0, 40.0}, Surface::reflecting)});
        const Vector3d target = centre + turn * Vector3d(random.uniform(-19.0, 19.0), random.uniform(-19.0, 19.0), 0.0);
        const Vector3d origin =
            target + 1000.0 * turn * Vector3d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), -1.0);
        const auto hit = scene.first_hit({origin, (target - origin).normalized()});
        ASSERT_TRUE(hit);
        // A few roundings of coordinates up to 1500 mm, 2.3e-13 mm each.
        EXPECT_NEAR(hit->distance, (target - origin).norm(), 3e-12);
        EXPECT_LE((hit->point - target).norm(), 3e-12);
        EXPECT_NEAR((hit->point - centre).dot(turn.col(2)), 0.0, 2e-12);
    }
}

TEST(Scene, RayNeverMeetsAgainTheFaceItJustLeft) {
    // From 10,000 points of a closed box into all directions: every ray must meet another of its six faces.
    std::vector<Face> box;
    const double size = 600.0;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
            Matrix3d turn;
            turn.col(2) = Vector3d::Unit(axis);
            turn.col(0) = Vector3d::Unit((axis + 1) % 3);
            turn.col(1) = Vector3d::Unit((axis + 2) % 3);
            box.push_back(make_rectangle(0.5 * side * size * Vector3d::Unit(axis) + Vector3d(1000.0, -300.0, 77.0),
                                         turn, {size, size}, Surface::reflecting));
        }
    const Scene scene(box);
    Random random;
    int grazing = 0;
    for (int i = 0; i < 10'000; ++i) {
        const int from = i % 6;
        const Vector3d inward = box[from].normal * (from % 2 ? -1.0 : 1.0);
        const Vector3d in_plane(random.uniform(-290.0, 290.0), random.uniform(-290.0, 290.0),
                                random.uniform(-290.0, 290.0));
        const Vector3d origin = box[from].point + in_plane - in_plane.dot(inward) * inward;
        Vector3d direction = random.direction();
        if (direction.dot(inward) < 0.0) direction = stepdiag::reflect(direction, inward);
        if (direction.dot(inward) < 0.01) {  // a ray within the plane may lie on either side of it in single precision
            ++grazing;
            continue;
        }
        const auto hit = scene.first_hit({origin, direction});
        ASSERT_TRUE(hit);
        EXPECT_NE(hit->face, from);
        EXPECT_GT(hit->distance, 9.0);
    }
    EXPECT_LT(grazing, 200);
}

TEST(Scene, HitOnABodyOfAThousandFacesIsOnItsSphere) {
    const double radius = 100.0;
    const auto sphere = make_sphere(radius, 24, 42);
    ASSERT_EQ(sphere.size(), 1008u);
    const Scene scene(sphere);
    Random random;
    for (int i = 0; i < 2000; ++i) {
        const Vector3d direction = random.direction();
        const auto hit = scene.first_hit({Vector3d::Zero(), direction});
        ASSERT_TRUE(hit);
        EXPECT_LE(hit->distance, radius * (1.0 + 1e-12));
        EXPECT_GT(hit->distance, radius * std::cos(0.5 * stepdiag::pi / 12.0));  // half a ring's chord below it
        for (const Face& face : sphere)                                   // the nearest plane, as this body is convex
            EXPECT_LE((hit->point - face.point).dot(face.normal), 1e-4);  // but for edges in single precision
    }
}

TEST(Scene, FacesAddedAreMetAsIfTheSceneWereMadeWithThem) {
    Random random;
    std::vector<Face> fixed, added;
    for (int i = 0; i < 30; ++i) {
        const Vector3d centre(random.uniform(-100.0, 100.0), random.uniform(-100.0, 100.0),
                              random.uniform(-100.0, 100.0));
        (i % 5 ? fixed : added)
            .push_back(make_rectangle(centre, stepdiag::rotation_exp(2.0 * random.direction()), {60.0, 40.0},
                                      Surface::reflecting));
    }
    std::vector<Face> all = fixed;
    all.insert(all.end(), added.begin(), added.end());
    const Scene whole(all), base(fixed),
        composite = base.with({added[0], added[1]}).with({added.begin() + 2, added.end()});
    ASSERT_EQ(composite.face_count(), 30);
    EXPECT_EQ(base.face_count(), 24);
    for (int i = 0; i < 30; ++i) EXPECT_EQ(composite.face(i).point, all[i].point);
    int met = 0, different = 0;
    for (int i = 0; i < 20'000; ++i) {
        const stepdiag::Ray ray{150.0 * random.direction(), random.direction()};
        const auto expected = whole.first_hit(ray), hit = composite.first_hit(ray);
        if (hit.has_value() != expected.has_value() || (hit && hit->face != expected->face)) {
            ++different;
            continue;
        }
        if (!hit) continue;
        ++met;
        EXPECT_EQ(hit->distance, expected->distance);
        EXPECT_EQ(hit->point, expected->point);
    }
    EXPECT_GT(met, 2000);
    EXPECT_LE(different, 2);  // rays within single precision of an edge
}

TEST(Scene, AddedFacesOfABodyLetNoRaySlipBetweenThem) {
    const stepdiag::Placement placement{{100.0, 50.0, -30.0}, stepdiag::rotation_exp({0.3, -0.1, 0.2})};
    const auto cube = stepdiag::make_corner_cube(20.0, {1.5}, placement);
    const Scene scene = Scene({}).with(cube);
    for (int i = 0; i < 1000; ++i) {  // at the three edges that meet in the origin
        const Vector3d edge = cube[1 + i % 3].outline[1] - cube[1].outline[0];
        const Vector3d target = cube[1].outline[0] + (i + 1) / 1001.0 * edge;
        const Vector3d origin = placement.position + placement.rotation * Vector3d(0.0, 0.0, 19.0);
        EXPECT_TRUE(scene.first_hit({origin, (target - origin).normalized()}));
    }
}

TEST(Scene, FaceThatMakesNoSenseIsRefusedByItsNumber) {
    const auto change = [](auto edit) {
        Face face = mirror_at(10.0);
        edit(face);
        return [face] { Scene({mirror_at(20.0), face}); };
    };
    constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinite = std::numeric_limits<double>::infinity();
    expect_refused(change([](Face& f) { f.outline.pop_back(), f.outline.pop_back(); }), "face 1");
    expect_refused(change([](Face& f) { f.outline.clear(); }), "face 1");
    expect_refused(change([](Face& f) { f.outline[2].z() += 1.0; }), "face 1");
    expect_refused(change([](Face& f) { f.outline[2].x() = undefined; }), "face 1");
    expect_refused(change([](Face& f) { f.outline[0].y() = infinite; }), "face 1");
    expect_refused(change([](Face& f) { f.point.x() = undefined; }), "face 1");
    expect_refused(change([](Face& f) { f.point.z() = infinite; }), "face 1");
    expect_refused(change([](Face& f) { f.normal *= 1.001; }), "face 1");
    expect_refused(change([](Face& f) { f.normal.setZero(); }), "face 1");
    expect_refused(change([](Face& f) { f.normal.y() = undefined; }), "face 1");
    expect_refused(change([](Face& f) { f.reflectance = 1.1; }), "face 1");
    expect_refused(change([](Face& f) { f.reflectance = undefined; }), "face 1");
    expect_refused(change([](Face& f) { f.absorptance = -0.1; }), "face 1");
    expect_refused(change([](Face& f) { f.surface = Surface::splitting, f.absorptance = 0.1; }), "together");
    expect_refused(change([](Face& f) { f.behind.index = 0.9; }), "face 1: expected an index");
    expect_refused(change([](Face& f) { f.before = stepdiag::Medium{undefined}; }), "face 1: expected an index");
    expect_refused([] { Scene({mirror_at(20.0)}).with({mirror_at(10.0), Face{}}); }, "face 2");
}
