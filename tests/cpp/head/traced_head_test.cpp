#include "stepdiag/head/traced_head.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "stepdiag/core/error.hpp"
#include "stepdiag/head/head.hpp"
#include "stepdiag/head/nominal_head.hpp"
#include "stepdiag/head/sensitivity.hpp"
#include "stepdiag/head/traced_reading.hpp"
#include "support/head_designs.hpp"
#include "support/refuses.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace stepdiag;
using namespace stepdiag::test;

const Vector2d mirror_size(150.0, 150.0);
const Environment air{Air{}};

std::vector<MirrorPose> some_poses(int count) {
    std::vector<MirrorPose> poses;
    for (int i = 0; i < count; ++i)
        poses.push_back(tilted_mirror({3.0 * std::sin(i), 2.0 * std::cos(i), 150.0 + 10.0 * i},
                                      3e-4 * std::sin(2.0 * i), 4e-4 * std::cos(3.0 * i)));
    return poses;
}

PoseErrors some_errors(const HeadDesign& design) {
    PoseErrors errors;
    double k = 1.0;
    for (const auto& body : design.bodies)
        errors[body.name] = {{0.02 * k, -0.03, 0.01 * k}, {2e-4, -1e-4 * k, 3e-4}}, ++k;
    for (const auto& beam : design.beams)
        errors[beam.name] = {{0.01, 0.02 * k, -0.01 * k}, {1e-4 * k, -2e-4, 1e-4}}, ++k;
    for (const auto& sensor : design.sensors) errors[sensor.name] = {{0.3, -0.2, 0.1}, {1e-3, 2e-3, -1e-3}};
    return errors;
}

TEST(TracedHead, ReplayIsTheTraceToRounding) {
    for (const HeadDesign& design : {three_beams(), beam_and_psd()}) {
        const TracedHead head(design, some_errors(design), air, mirror_size);
        const auto poses = some_poses(50);
        ReplayCount count;
        for (int beam = 0; beam < int(design.beams.size()); ++beam) {
            const auto replayed = head.replay(beam, poses, {0.5, 1}, &count);
            for (std::size_t i = 0; i < poses.size(); ++i) {
                const Arrivals traced = head.arrivals(beam, poses[i]);
                ASSERT_EQ(traced.size(), 1u);
                ASSERT_EQ(replayed[i].size(), 1u);
                // Paths of 2 m: some units of double precision's last place each time a length is added.
                EXPECT_NEAR(replayed[i][0].beam.optical_length, traced[0].beam.optical_length, 5e-12);
                EXPECT_LE((replayed[i][0].beam.position - traced[0].beam.position).norm(), 5e-12);
                EXPECT_EQ(replayed[i][0].power, traced[0].power);
            }
        }
        EXPECT_EQ(count.replayed, long(50 * design.beams.size()));
        EXPECT_EQ(count.traced, 0);
        EXPECT_GT(count.verified, 25);
    }
}

TEST(TracedHead, PoseThatLosesItsBeamIsTracedAndLost) {
    const TracedHead head(three_beams(), {}, air, mirror_size);
    auto poses = some_poses(20);
    poses[7] = tilted_mirror({0.0, 0.0, 500.0}, 0.02, 0.0);  // comes back 20 mm beside its collimator
    ReplayCount count;
    const auto arrivals = head.replay(0, poses, {0.0, 0}, &count);
    EXPECT_EQ(count.traced, 1);
    for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_EQ(arrivals[i].size(), i == 7 ? 0u : 1u) << i;
}

TEST(TracedHead, FaceNearThePathIsNotReplayedOver) {
    // A screen whose edge clips what returns more than 0.2 mm beside the beam.
    HeadDesign design = three_beams();
    design.bodies.push_back({"screen", make_screen(4.0, 4.0), 1.0, {{2.2, 0.0, 5.0}, Eigen::Matrix3d::Identity()}});
    const TracedHead head(design, {}, air, mirror_size);
    ReplayCount count;
    int lost = 0;
    const auto poses = some_poses(40);
    const auto arrivals = head.replay(0, poses, {0.0, 0}, &count);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(arrivals[i].size(), head.arrivals(0, poses[i]).size());
        lost += arrivals[i].empty();
    }
    EXPECT_EQ(count.replayed, 0);
    EXPECT_GT(lost, 5);
    EXPECT_LT(lost, 35);
}

TEST(TracedHead, WhatOnlyAPoseInBetweenMeetsIsNotReplayedOver) {
    // The first, the middle and the last pose are aligned; others in between lean towards the screen.
    HeadDesign design = three_beams();
    design.bodies.push_back({"screen", make_screen(4.0, 4.0), 1.0, {{4.5, 0.0, 5.0}, Eigen::Matrix3d::Identity()}});
    const TracedHead head(design, {}, air, mirror_size);
    std::vector<MirrorPose> poses;
    for (int i = 0; i <= 40; ++i) poses.push_back(tilted_mirror({0, 0, 500.0 + 10.0 * i}, 0.0, i % 20 ? -3e-3 : 0.0));
    ReplayCount count;
    const auto arrivals = head.replay(0, poses, {0.0, 0}, &count);
    EXPECT_EQ(count.replayed, 0);
    for (int i = 0; i <= 40; ++i) EXPECT_EQ(arrivals[i].empty(), i % 20 != 0) << i;
}

TEST(TracedHead, CoatedWindowSendsGhostsToItsSensor) {
    HeadDesign design = beam_and_psd();
    for (Face& face : design.bodies[0].faces) {
        face.surface = Surface::splitting;
        face.reflectance = 0.01;
    }
    const TracedHead head(design, {}, air, mirror_size);
    const auto arrivals = head.arrivals(1, tilted_mirror({0.0, 0.0, 300.0}, 1e-4, 2e-4));
    ASSERT_GT(arrivals.size(), 2u);
    // Two passes of the splitter and four of the window's faces.
    EXPECT_NEAR(arrivals[0].power, 0.25 * std::pow(0.99, 4), 1e-12);
    // The window's first face sends R straight back: stronger than all ghosts that saw the mirror, but straylight.
    const auto straylight = std::find_if(arrivals.begin(), arrivals.end(),
                                         [](const Arrival& a) { return std::abs(a.power - 0.25 * 0.01) < 1e-12; });
    ASSERT_NE(straylight, arrivals.end());
    EXPECT_LT((straylight - 1)->power, straylight->power);
}

TEST(TracedHead, GhostTakesNoInterferometersPlace) {
    // A coated window, tilted against ghosts: where the beam's own light has left the aperture, weak ghosts still meet
    // it.
    HeadDesign design = three_beams();
    for (Face& face : design.bodies[0].faces) {
        face.surface = Surface::splitting;
        face.reflectance = 0.0025;
    }
    design.bodies[0].placement.rotation = rotation_exp({0.0, 5e-3, 0.0});
    const TracedHead head(design, {}, air, mirror_size);
    int ghosts = 0;
    for (int i = -80; i <= 80; ++i) {
        const MirrorPose pose = tilted_mirror({0.0, 0.0, 1200.0}, 0.0, 1e-4 * i);
        const Arrivals arrivals = head.arrivals(0, pose);
        if (!arrivals.empty()) {
            EXPECT_NEAR(arrivals[0].power, std::pow(1.0 - 0.0025, 4), 1e-12) << i;
        }
        ghosts += arrivals.empty() && !head.trace(0, pose).arrivals(head.detector_face(0)).empty();
    }
    EXPECT_GT(ghosts, 0);
}

TEST(NominalHead, KnowsOffsetsPsdDistanceAndGlass) {
    const double n = refractive_index(Material(find_glass("N-BK7")), 1530.0) / refractive_index(air, 1530.0);
    const NominalHead three = nominal_head(three_beams(), 100.0, air);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(three.calibration.head_constants[i], 5.0 * (n - 1.0), 1e-12);
        // Rounding of the path (1e-13 mm) over the tilt of 1e-3 and the tenth of the way that it is found with.
        EXPECT_LE((three.calibration.beam_offsets[i] - Vector2d(i == 1 ? 20 : 0, i == 2 ? 20 : 0)).norm(), 1e-8);
    }
    const double r = refractive_index(air, 635.0) / refractive_index(Material(find_glass("N-BK7")), 635.0);
    const NominalHead psd = nominal_head(beam_and_psd(), 100.0, air);
    // From the window's far side to the PSD: glass counts r. Found with tilts of 1e-5: rounding 1e-13/1e-5 over 2.
    const double back_to_psd = 5.0 * (r - 1.0) + 20.0 + 20.0 * r + 10.0;
    EXPECT_NEAR(*psd.calibration.psd_distance, back_to_psd, 2e-8);
    EXPECT_LE((psd.calibration.spot_beam - Vector2d(20.0, 0.0)).norm(), 1e-11);
}

TEST(TracedReading, IsTheDefinitionForAPerfectHead) {
    for (const HeadDesign& design : {three_beams(), beam_and_psd()}) {
        HeadDesign bare = design;
        bare.bodies.erase(bare.bodies.begin());  // the window: glass is not in the definition
        const Head head = make_head(bare, 100.0);
        const TracedReader reader(head, mirror_size, {air, {}, {}, 0});
        for (const MirrorPose& pose : some_poses(20)) {
            const auto reading = read_mirror(pose.point, pose.rotation.col(2));
            const Eigen::VectorXd defined =
                design.layout == HeadLayout::psd
                    ? (Eigen::VectorXd(3) << reading->distance,
                       spot_position(*reading, *head.nominal.psd_distance, head.nominal.spot_beam))
                          .finished()
                    : beam_distances(*reading, head.nominal.beam_offsets);
            const SignalRow row = reader.trace(pose);
            for (int c = 0; c < 3; ++c) {
                const bool is_spot = design.layout == HeadLayout::psd && c > 0;
                // Distances to rounding; the spot to the third order in the cube, 20 mm (1e-3)^3, and the PSD distance.
                EXPECT_NEAR(*row[c], defined[c], is_spot ? 2e-8 : 5e-12) << c;
            }
        }
    }
}

TEST(TracedReading, CameraFindsTheSpotOfTheChiefRay) {
    const HeadDesign with_psd = beam_and_psd();
    HeadDesign with_camera = with_psd;
    Camera camera;
    camera.pixel = 0.04;
    camera.columns = camera.rows = 256;
    camera.electrons = 4e6;  // a quarter of the power comes to the sensor
    camera.shot_noise = true;
    with_camera.sensors[0].device = camera;
    ReadingConditions conditions;
    conditions.environment = air;
    const TracedReader psd(make_head(with_psd, 100.0), mirror_size, conditions);
    const TracedReader picture(make_head(with_camera, 100.0), mirror_size, conditions);
    const auto poses = some_poses(6);
    const auto axes = psd.read(poses), spots = picture.read(poses);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(*axes[i][0], *spots[i][0]);
        // A million electrons: radius/2 sqrt(1e-6) = 0.4 um of 0.8 mm, and five times that.
        for (int c : {1, 2}) EXPECT_NEAR(*axes[i][c], *spots[i][c], 2e-3) << i;
    }
}

TEST(Sensitivity, IsTheSlopeOfTheReadings) {
    const MirrorPose pose = tilted_mirror({0.0, 0.0, 600.0}, 1e-4, -2e-4);
    for (const HeadDesign& design : {three_beams(), beam_and_psd()}) {
        const Head head = make_head(design, 100.0);
        std::set<std::string> seen;
        for (const Sensitivity& s : head_sensitivities(head, pose, mirror_size, air)) {
            seen.insert(s.component);
            if (s.quantity.find(' ') == std::string::npos || s.component == "mirror" ||
                s.component == "all interferometers")
                continue;
            const int axis = s.quantity.back() - 'x';
            const bool turns = s.quantity[0] == 'r';
            const double h = turns ? 1e-4 : 1e-2;  // rounding 1e-13/h; third orders of some 100 mm h^2
            const auto at = [&](double step) {
                Head other = head;
                (turns ? other.pose_errors[s.component].rotation : other.pose_errors[s.component].shift)[axis] = step;
                return TracedReader(other, mirror_size, {air, {}, {}, 0}).trace(pose);
            };
            const SignalRow high = at(h), low = at(-h);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(s.signals[c], (*high[c] - *low[c]) / (2.0 * h), 1e-8 + 1e-7 * std::abs(s.signals[c]))
                    << s.component << " " << s.quantity << " signal " << c;
        }
        for (const auto& body : design.bodies) EXPECT_TRUE(seen.count(body.name));
        EXPECT_TRUE(seen.count("mirror"));
        EXPECT_TRUE(seen.count("air"));
    }
}

TEST(HeadDesign, RefusesWhatMakesNoHead) {
    const auto refused = [](HeadDesign design, const auto& change, const char* expected) {
        change(design);
        expect_refused([&] { check_design(design); }, expected);
    };
    using D = HeadDesign;
    refused(three_beams(), [](D& d) { d.beams.pop_back(); }, "three or more");
    refused(beam_and_psd(), [](D& d) { d.sensors.clear(); }, "one beam to a sensor");
    refused(beam_and_psd(), [](D& d) { d.beams[1].sensor = "camera"; }, "there is no sensor");
    refused(three_beams(), [](D& d) { d.beams[1].name = "d1"; }, "d1: given twice");
    refused(three_beams(), [](D& d) { d.bodies[0].name = ""; }, "expected a name");
    refused(three_beams(), [](D& d) { d.bodies[0].placement.position.z() = 2.5; }, "window and d1: overlap or touch");
    refused(beam_and_psd(), [](D& d) { d.bodies[1].placement.position.z() = 5.0; }, "window and splitter: overlap");
    refused(
        three_beams(),
        [](D& d) { d.bodies.push_back({"lid", make_screen(60, 60), 1.0, {{0, 0, 30}, Eigen::Matrix3d::Identity()}}); },
        "does not meet a mirror");
    refused(beam_and_psd(), [](D& d) { d.sensors[0].placement.position.x() = 45.0; }, "to its sensor psd");
    refused(three_beams(), [](D& d) { d.beams[0].mode.waist_radius = 0.0; }, "waist_radius");
    refused(three_beams(), [](D& d) { d.bodies[0].placement.rotation *= 2.0; }, "rotation");
    refused(beam_and_psd(), [](D& d) { d.beams[0].placement.position = {0.0, 5.0, 0.0}; }, "at x = 0, y = 0");
    expect_refused([] { make_head(three_beams(), 10.0); }, "standoff");
    PoseErrors into_collimator;
    into_collimator["window"].shift.z() = -12.0;
    expect_refused([&] { make_head(three_beams(), 100.0, {}, into_collimator); }, "with their pose errors");
    refused(three_beams(), [](D& d) { d.bodies[0] = window(1e-3); }, "window: too thin");
    expect_refused([] { make_head(three_beams(), 100.0, {}, {{"psd", {}}}); }, "no component \"psd\"");
}

}  // namespace
