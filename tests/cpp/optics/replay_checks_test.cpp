#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "stepdiag/core/error.hpp"
#include "stepdiag/optics/replay.hpp"
#include "support/recorded_route.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Encounter;
using stepdiag::Event;
using stepdiag::Face;
using stepdiag::make_rectangle;
using stepdiag::Surface;

const double not_a_number = std::numeric_limits<double>::quiet_NaN();

Face square(double z, double size, Surface surface, const Matrix3d& turn = Matrix3d::Identity()) {
    return make_rectangle({0, 0, z}, turn, {size, size}, surface);
}

}  // namespace

TEST(Replay, NaNInAnyNumberFailsItsLaneAndNoOther) {
    const Bench bench;
    const RecordedRoute recorded = bench.record();
    auto route = recorded.route;
    ByLane by_lane;
    by_lane.spread(route, 21);
    std::size_t lane = 0;
    const auto expect_one_lost = [&](RayLanes& lanes, const std::string& what) {
        lanes.follow(route, gap);
        for (std::size_t i = 0; i < lanes.lanes(); ++i) ASSERT_EQ(lanes.followed[i], i != lane) << what;
        lane = (lane + 5) % lanes.lanes();
    };
    for (std::size_t k = 0; k < by_lane.arrays.size(); ++k) {
        RayLanes lanes = fan(bench, 21);
        const double good = by_lane.arrays[k][lane];
        const std::size_t was = lane;
        by_lane.arrays[k][lane] = not_a_number;
        expect_one_lost(lanes, "number " + std::to_string(k) + " of the faces");
        by_lane.arrays[k][was] = good;
    }
    for (int k = 0; k < 8; ++k) {
        RayLanes lanes = fan(bench, 21);
        lanes.start[k][lane] = not_a_number;
        expect_one_lost(lanes, "number " + std::to_string(k) + " of the rays");
    }
}

TEST(Replay, NaNCommonToAllLanesFailsAll) {
    const Bench bench;
    const RecordedRoute recorded = bench.record();
    for (std::size_t n = 0; n < recorded.route.size(); ++n) {
        auto route = recorded.route;
        const std::size_t count = numbers(route[n]).size();
        for (std::size_t k = 0; k < count; ++k) {
            route = recorded.route;
            *numbers(route[n])[k] = {&not_a_number, 0};
            RayLanes lanes = fan(bench, 9);
            lanes.follow(route, gap);
            for (std::size_t i = 0; i < lanes.lanes(); ++i) ASSERT_EQ(lanes.followed[i], 0);
        }
    }
}

TEST(Replay, LaneOutsideTheOutlineFails) {
    RecordedRoute one;
    one.meet(Event::absorbed, square(100, 20, Surface::absorbing), 1.0, 1.0);
    RayLanes lanes(7, {{0, 0, 0}, {0, 0, 1}});
    lanes.start[0] = {0.0, 9.999, 10.001, 0.0, 0.0, -10.001, -9.999};
    lanes.start[1] = {0.0, 9.999, 0.0, 10.001, -10.001, 0.0, -9.999};
    lanes.follow(one.route, gap);
    EXPECT_EQ(lanes.followed, (std::vector<std::uint8_t>{1, 1, 0, 0, 0, 0, 1}));
    EXPECT_EQ(lanes.end[2], std::vector<double>(7, 100.0));
    EXPECT_EQ(lanes.end[5], std::vector<double>(7, 1.0));  // what is absorbed keeps its direction
}

TEST(Replay, AnyConvexOutlineIsKept) {
    // A pentagon, either way round, against the winding of its corners around the point.
    for (const double way : {1.0, -1.0}) {
        Face face{{0, 0, 50}, {0, 0, 1}, {}, Surface::absorbing};
        for (int k = 0; k < 5; ++k) {
            const double angle = way * 2.0 * stepdiag::pi * (k + 0.1 * (k % 2)) / 5.0;
            face.outline.push_back({4.0 + 10.0 * std::cos(angle), -3.0 + 10.0 * std::sin(angle), 50.0});
        }
        RecordedRoute one;
        one.meet(Event::absorbed, face, 1.0, 1.0);
        EXPECT_FALSE(one.outlines[0].is_centred_rectangle);
        std::mt19937 random(5);
        std::uniform_real_distribution<double> place(-12.0, 12.0);
        RayLanes lanes(1000, {{0, 0, 0}, {0, 0, 1}});
        for (std::size_t i = 0; i < lanes.lanes(); ++i)
            lanes.start[0][i] = 4.0 + place(random), lanes.start[1][i] = -3.0 + place(random);
        lanes.follow(one.route, gap);
        int inside = 0;
        for (std::size_t i = 0; i < lanes.lanes(); ++i) {
            const Vector3d point(lanes.start[0][i], lanes.start[1][i], 50.0);
            bool all = true;
            for (int k = 0; k < 5; ++k) {
                const Vector3d from = face.outline[k], to = face.outline[(k + 1) % 5];
                all = all && way * (to - from).cross(point - from).z() >= 0.0;
            }
            ASSERT_EQ(lanes.followed[i], all) << point.transpose();
            inside += all;
        }
        EXPECT_GT(inside, 250);
    }
}

TEST(Replay, FaceBehindOrNearerThanTheGapFails) {
    RecordedRoute one;
    one.meet(Event::reflected, square(100, 20, Surface::reflecting), 1.0, 1.0);
    RayLanes lanes(4, {{0, 0, 0}, {0, 0, 1}});
    lanes.start[2] = {0.0, 101.0, 100.0 - 0.9 * gap, 100.0 - 1.1 * gap};
    lanes.follow(one.route, gap);
    EXPECT_EQ(lanes.followed, (std::vector<std::uint8_t>{1, 0, 0, 1}));
}

TEST(Replay, RefractionAndTotalReflectionMustBeAsRecorded) {
    // Out of glass at angles about the critical one, asin(1/1.5) = 0.7297.
    const double critical = std::asin(1.0 / 1.5);
    for (const Event event : {Event::refracted, Event::totally_reflected}) {
        RecordedRoute one;
        one.meet(event, square(100, 1000, Surface::refracting), 1.5, 1.0);
        RayLanes lanes(6, {{0, 0, 0}, {0, 0, 1}});
        const std::vector<double> angle{0.0, 0.5, critical - 1e-9, critical + 1e-9, 0.9, -0.9};
        for (std::size_t i = 0; i < 6; ++i)
            lanes.start[3][i] = std::sin(angle[i]), lanes.start[5][i] = std::cos(angle[i]);
        lanes.follow(one.route, gap);
        for (std::size_t i = 0; i < 6; ++i)
            EXPECT_EQ(lanes.followed[i], (event == Event::refracted) == (std::abs(angle[i]) < critical)) << angle[i];
    }
}

TEST(Replay, LightGoesStraightOnWhereTheMediumIsTheSame) {
    RecordedRoute one;
    const Matrix3d turn = stepdiag::rotation_exp({0.3, 0.7, 0.1});
    one.meet(Event::refracted, square(100, 100, Surface::refracting, turn), 1.5, 1.5);
    EXPECT_FALSE(one.route[0].deflects);
    const Vector3d direction = Vector3d(0.1, -0.2, 0.9).normalized();
    RayLanes lanes(3, {{0, 0, 0}, direction});
    lanes.follow(one.route, gap);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(lanes.followed[i], 1);
        EXPECT_EQ(lanes.direction(i), direction);
        const double length = lanes.point(i).norm();
        EXPECT_NEAR(lanes.end[6][i], 1.5 * length, 1e-13);  // a few roundings of 200 mm
        EXPECT_NEAR(lanes.end[7][i], length / 1.5, 1e-13);
    }
}

TEST(Replay, RefusesStridesThatItCannotTake) {
    const Bench bench;
    const RecordedRoute recorded = bench.record();
    auto route = recorded.route;
    route[3].translation[1].stride = 2;
    RayLanes lanes = fan(bench, 3);
    EXPECT_THROW(lanes.follow(route, gap), stepdiag::InvalidArgument);
}
