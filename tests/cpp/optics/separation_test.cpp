#include "optics/separation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "support/refuses.hpp"
#include "support/sphere.hpp"

namespace {

using namespace stepdiag;
using Eigen::Vector3d;

constexpr Medium glass{1.5};

// Of lengths of some hundreds of millimetres.
constexpr double rounding = 1e-10;

std::vector<Face> cube(const Vector3d& position, const Vector3d& turn = Vector3d::Zero()) {
    return make_plate(10.0, 10.0, 10.0, glass, {position, rotation_exp(turn)});
}

}  // namespace

TEST(Separation, IsTheDistanceOfFacesEdgesAndCorners) {
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({0, 0, 30})), 20.0, rounding);    // faces
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({0, 13, 14})), 5.0, rounding);    // edges: 3, 4
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({12, -13, 16})), 7.0, rounding);  // corners: 2, 3, 6
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({0, 0, 30}, {0, pi / 4, 0})), 25.0 - 5.0 * std::sqrt(2.0), rounding);
    // Two edges that cross at right angles.
    EXPECT_NEAR(separation(cube({0, 0, 0}, {0, pi / 4, 0}), cube({0, 0, 30}, {pi / 4, 0, 0})),
                30.0 - 10.0 * std::sqrt(2.0), rounding);
}

TEST(Separation, ThinGapsAreFoundHoweverTheBodiesStand) {
    std::mt19937_64 engine(4);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < 200; ++i) {
        const Placement common{{100.0 * uniform(engine), 0.0, 50.0},
                               rotation_exp({3.0 * uniform(engine), 3.0 * uniform(engine), 3.0 * uniform(engine)})};
        const Vector3d shift(6.0 * uniform(engine), 6.0 * uniform(engine), 0.0);
        for (const double gap : {1e-6, 1e-3, -1e-6}) {
            const auto a = placed(cube({0, 0, 0}), common);
            const auto b = placed(cube(shift + Vector3d(0.0, 0.0, 10.0 + gap), {0, 0, uniform(engine)}), common);
            EXPECT_NEAR(separation(a, b), std::max(gap, 0.0), rounding) << i;
        }
    }
}

TEST(Separation, OfWhatTouchesOrOverlapsIsNone) {
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({0, 0, 10})), 0.0, rounding);
    EXPECT_NEAR(separation(cube({0, 0, 0}), cube({10, 10, 10})), 0.0, rounding);
    EXPECT_EQ(separation(cube({0, 0, 0}), cube({0, 0, 9.999})), 0.0);
    EXPECT_EQ(separation(cube({0, 0, 0}), cube({0, 0, 0})), 0.0);
    EXPECT_EQ(separation(cube({0, 0, 0}), make_plate(1, 1, 1, glass)), 0.0);                               // inside
    EXPECT_EQ(separation(make_plate(100, 1, 1, glass), make_plate(1, 100, 1, glass)), 0.0);                // a cross
    EXPECT_EQ(separation(make_mirror(20.0, 20.0), make_mirror(20.0, 20.0, 1.0, {{5.0, 0.0, 0.0}})), 0.0);  // one plane
}

TEST(Separation, FlatPiecesCountWhereTheyAre) {
    const auto mirror = make_mirror(20.0, 20.0);
    EXPECT_NEAR(separation(mirror, make_screen(5.0, 5.0, {{0.0, 0.0, 1e-3}})), 1e-3, rounding);
    EXPECT_NEAR(separation(mirror, make_screen(5.0, 5.0, {{13.0, 0.0, 0.0}})), 0.5, rounding);
    EXPECT_NEAR(separation(mirror, cube({0.0, 0.0, 5.25})), 0.25, rounding);
}

TEST(Separation, SplittingFaceInsideItsCubeChangesNothing) {
    const auto splitter = make_cube_splitter(10.0, glass);
    EXPECT_NEAR(separation(splitter, cube({0, 0, 10.5})), 0.5, rounding);
    EXPECT_EQ(separation(splitter, make_screen(1.0, 1.0, {{3.0, 0.0, 0.0}})), 0.0);
}

TEST(Separation, OfSpheresIsThatOfTheirCentresLessBothRadii) {
    std::mt19937_64 engine(3);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 20; ++i) {
        const Vector3d aim = Vector3d(normal(engine), normal(engine), normal(engine)).normalized();
        for (const double gap : {-1.0, 0.2, 1.0, 30.0}) {
            const auto a = make_sphere(10.0, 24, 42);  // a thousand faces
            const auto b = make_sphere(20.0, 24, 42, {(30.0 + gap) * aim, rotation_exp(aim)});
            const double found = separation(a, b);
            EXPECT_EQ(found, separation(a, b));  // to the last bit
            EXPECT_NEAR(found, separation(b, a), rounding);
            if (gap < 0.0) {
                EXPECT_EQ(found, 0.0);
            } else {
                EXPECT_GT(found, gap);
                EXPECT_LT(found, gap + 30.0 * 0.012);  // faces are below their sphere by 1 - cos(pi/24) cos(pi/42)
            }
        }
    }
}

TEST(Separation, NothingAtAllIsRefused) {
    expect_refused([] { separation({}, cube({0, 0, 0})); }, "separation");
    auto undefined = cube({0, 0, 0});
    undefined[0].outline[0].x() = std::nan("");
    expect_refused([&] { separation(cube({0, 0, 0}), undefined); }, "separation");
}
