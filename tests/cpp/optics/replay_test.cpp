#include "stepdiag/optics/replay.hpp"

#include <gtest/gtest.h>

#include <string>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/instruction_set.hpp"
#include "support/recorded_route.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Encounter;
using stepdiag::Face;
using stepdiag::make_rectangle;
using stepdiag::Path;
using stepdiag::PathEnd;
using stepdiag::Surface;

// Another instruction set for as long as this lives.
struct Target {
    std::string before = stepdiag::instruction_set();
    explicit Target(const std::string& name) { stepdiag::choose_instruction_set(name); }
    ~Target() { stepdiag::choose_instruction_set(before); }
};

}  // namespace

TEST(Replay, IsTheTraceToRounding) {
    int absorbed = 0;
    for (unsigned seed = 1; seed <= 100; ++seed) {
        const Bench bench(seed);
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
    EXPECT_GE(absorbed, 50);  // the others leave the scene on their way back
}

TEST(Replay, EveryLaneMayHaveItsOwnPlanesAndIndices) {
    // Benches that light passes in the same order, one a lane.
    const auto recorded = Bench(1).record();
    std::vector<Encounter> route = recorded.route;
    std::deque<Bench> benches;
    for (unsigned seed = 1; benches.size() < 37; ++seed) {
        const Bench bench(seed);
        if (bench.record().faces == recorded.faces && bench.path().events == Bench(1).path().events)
            benches.push_back(bench);
    }
    ByLane by_lane;
    by_lane.spread(route, benches.size());
    for (std::size_t i = 0; i < benches.size(); ++i) {
        benches[i].air.index += 1e-5 * double(i);  // after the bodies were made: the same glass
        RecordedRoute own = benches[i].record();
        std::size_t array = 0;
        for (Encounter& encounter : own.route)
            for (const stepdiag::LaneValue* value : numbers(encounter)) by_lane.arrays[array++][i] = *value->value;
    }
    RayLanes lanes(benches.size(), benches[0].ray);
    lanes.follow(route, gap);
    for (std::size_t i = 0; i < benches.size(); ++i) {
        const Path path = benches[i].path();
        ASSERT_EQ(lanes.followed[i], 1);
        ASSERT_NEAR(lanes.end[6][i], path.optical_length, 5e-12);  // as above
        ASSERT_LE((lanes.point(i) - path.hits.back().point).norm(), 1e-11);
        ASSERT_LE((lanes.direction(i) - path.direction).norm(), 1e-14);
    }
}

TEST(Replay, AllInstructionSetsAgreeToRounding) {
    const Bench bench;
    RayLanes first = fan(bench, 45);
    first.follow(bench.record().route, gap);
    EXPECT_GE(stepdiag::instruction_sets().size(), 1u);
    for (const std::string& name : stepdiag::instruction_sets()) {
        const Target target(name);
        EXPECT_EQ(stepdiag::instruction_set(), name);
        RayLanes lanes = fan(bench, 45);
        lanes.follow(bench.record().route, gap);
        for (std::size_t i = 0; i < lanes.lanes(); ++i) {
            ASSERT_EQ(lanes.followed[i], 1) << name;
            for (int k = 0; k < 8; ++k) {
                // Roundings of 2000 mm along a dozen planes, and of unit vectors.
                ASSERT_NEAR(lanes.end[k][i], first.end[k][i], k == 3 || k == 4 || k == 5 ? 1e-14 : 1e-11) << name;
            }
        }
    }
    EXPECT_THROW(stepdiag::choose_instruction_set("abacus"), stepdiag::InvalidArgument);
}

TEST(Replay, ALaneHasTheSameBitsAnywhere) {
    const Bench bench;
    for (const std::string& name : stepdiag::instruction_sets()) {
        const Target target(name);
        const auto common = bench.record();
        RayLanes all = fan(bench, 41);
        all.follow(common.route, gap);
        for (std::size_t lanes = 0; lanes <= 41; ++lanes) {  // from the front, and shifted to the end
            const std::size_t from = 41 - lanes;
            RayLanes front = fan(bench, lanes), back = fan(bench, lanes);
            for (int k = 0; k < 8; ++k)
                for (std::size_t i = 0; i < lanes; ++i) back.start[k][i] = all.start[k][from + i];
            ByLane by_lane;
            auto route = common.route;
            by_lane.spread(route, lanes);
            front.follow(common.route, gap);
            back.follow(route, gap);
            for (int k = 0; k < 8; ++k)
                for (std::size_t i = 0; i < lanes; ++i) {
                    ASSERT_EQ(front.end[k][i], all.end[k][i]) << name << ", " << lanes << " lanes";
                    ASSERT_EQ(back.end[k][i], all.end[k][from + i]) << name << ", " << lanes << " lanes, by lane";
                }
        }
    }
}

TEST(Replay, GoesOnInPlaceWhereAnotherRouteEnded) {
    const Bench bench;
    const auto recorded = bench.record();
    const std::size_t half = recorded.route.size() / 2;
    const std::vector<Encounter> out(recorded.route.begin(), recorded.route.begin() + half);
    const std::vector<Encounter> back(recorded.route.begin() + half, recorded.route.end());
    for (std::size_t lanes = 1; lanes <= 40; ++lanes) {
        RayLanes once = fan(bench, lanes), twice = fan(bench, lanes);
        once.follow(recorded.route, gap);
        twice.follow(out, gap);
        for (int k = 0; k < 8; ++k) twice.start[k].swap(twice.end[k]);
        const auto start = twice.rays();
        for (int k = 0; k < 8; ++k) twice.start[k].swap(twice.end[k]);  // `start` now points into what is written
        replay(back, start, lanes, gap, twice.results());
        for (int k = 0; k < 8; ++k) ASSERT_EQ(once.end[k], twice.end[k]) << lanes << " lanes";
    }
}

TEST(Replay, WritesNothingBeyondItsLanes) {
    const Bench bench;
    const auto recorded = bench.record();
    for (std::size_t lanes = 0; lanes <= 40; ++lanes) {
        RayLanes more = fan(bench, 48);
        replay(recorded.route, more.rays(), lanes, gap, more.results());
        for (std::size_t i = 0; i < 48; ++i) ASSERT_EQ(more.followed[i], i < lanes ? 1 : 9);
        for (int k = 0; k < 8; ++k)
            for (std::size_t i = lanes; i < 48; ++i) ASSERT_EQ(more.end[k][i], -1.0);
    }
}

TEST(Replay, FrameStandsInTheMiddleOfARectangle) {
    const Matrix3d turn = stepdiag::rotation_exp({0.5, -1.0, 2.0});
    const Vector3d centre(700, -400, 1300);
    const Face face = make_rectangle(centre, turn, {30, 20}, Surface::reflecting);
    const auto frame = frame_of(face);
    const auto outline = outline_of(face, frame);
    EXPECT_TRUE(outline.is_centred_rectangle);
    EXPECT_NEAR(outline.half_size.x(), 15.0, 1e-12);  // roundings of 1500 mm
    EXPECT_NEAR(outline.half_size.y(), 10.0, 1e-12);
    Matrix3d rotation;
    for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = frame.rotation[k];
    EXPECT_LE((rotation - turn.transpose()).norm(), 1e-15);
    EXPECT_LE((rotation * centre + Vector3d(frame.translation[0], frame.translation[1], frame.translation[2])).norm(),
              1e-12);
}
