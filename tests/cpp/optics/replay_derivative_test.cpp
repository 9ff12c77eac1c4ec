#include "optics/replay_derivative.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "support/recorded_route.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Dual;
using stepdiag::DualEncounter;
using stepdiag::DualRay;
using stepdiag::Encounter;
using stepdiag::Event;
using stepdiag::FaceFrame;
using stepdiag::make_rectangle;
using stepdiag::moving;
using stepdiag::Ray;
using stepdiag::RigidRate;
using stepdiag::Surface;

RigidRate turning(const Vector3d& rotation, const Vector3d& about) {
    RigidRate rate;
    rate.rotation = rotation, rate.about = about;
    return rate;
}
RigidRate shifting(const Vector3d& shift) {
    RigidRate rate;
    rate.shift = shift;
    return rate;
}

// What one parameter moves and changes.
struct Parameter {
    int first_face = 0, end_face = 0;  // of the scene, moved together
    RigidRate motion = {};
    RigidRate source = {};
    double glass = 0.0, air = 0.0;  // rates of the indices
};

std::vector<DualEncounter> with_slopes(const RecordedRoute& recorded, const Bench& bench, const Parameter& by) {
    std::vector<DualEncounter> route;
    const auto index = [&](const stepdiag::LaneValue& value) {
        return Dual{*value.value, *value.value == bench.glass.index ? by.glass : by.air};
    };
    for (std::size_t i = 0; i < recorded.route.size(); ++i) {
        const Encounter& encounter = recorded.route[i];
        const bool moves = by.first_face <= recorded.faces[i] && recorded.faces[i] < by.end_face;
        route.push_back({encounter.event, encounter.deflects,
                         moving(recorded.frames[i], moves ? by.motion : RigidRate{}), encounter.outline,
                         index(encounter.index_before), index(encounter.index_after)});
    }
    return route;
}

// The frame of a face that the parameter has really moved, by `h` of its units: local = R (x moved back) + t.
FaceFrame moved(const FaceFrame& frame, const RigidRate& rate, double h) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(frame.rotation.data());
    const Eigen::Map<const Vector3d> t(frame.translation.data());
    FaceFrame made;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(made.rotation.data());
    rotation = R * stepdiag::rotation_exp(-h * rate.rotation);
    Eigen::Map<Vector3d>(made.translation.data()) = t + R * rate.about - rotation * (rate.about + h * rate.shift);
    return made;
}

// Point, direction, optical and reduced length at the end of the route, the parameter at `h`.
Eigen::Matrix<double, 8, 1> end_at(const Bench& bench, const Parameter& by, double h) {
    RecordedRoute recorded = bench.record();
    for (std::size_t i = 0; i < recorded.route.size(); ++i)
        if (by.first_face <= recorded.faces[i] && recorded.faces[i] < by.end_face)
            recorded.frames[i] = moved(recorded.frames[i], by.motion, h);
    for (double& index : recorded.indices) index += h * (index == bench.glass.index ? by.glass : by.air);
    const Matrix3d turn = stepdiag::rotation_exp(h * by.source.rotation);
    const Vector3d about = by.source.about;
    RayLanes lane(1, {turn * (bench.ray.origin - about) + about + h * by.source.shift, turn * bench.ray.direction});
    lane.follow(recorded.route, gap);
    EXPECT_EQ(lane.followed[0], 1);
    Eigen::Matrix<double, 8, 1> end;
    for (int k = 0; k < 8; ++k) end[k] = lane.end[k][0];
    return end;
}

std::array<Dual, 8> numbers(const DualRay& ray) {
    return {ray.point[0],     ray.point[1],     ray.point[2],       ray.direction[0],
            ray.direction[1], ray.direction[2], ray.optical_length, ray.reduced_length};
}

void expect_slopes_are_differences(const Bench& bench, const Parameter& by, const std::string& name) {
    const auto end = replay(with_slopes(bench.record(), bench, by), moving(bench.ray, by.source), gap);
    ASSERT_TRUE(end) << name;
    const auto here = end_at(bench, by, 0.0);
    // Errors of the difference: roundings of 1e-12 mm (1e-15 of a direction) over 2 h, and h^2/6 of third derivatives
    // below 1e5 mm (1e2 of a direction). Both are some 1e-6 mm and 1e-9.
    const double h = 1e-5;
    const auto difference = ((end_at(bench, by, h) - end_at(bench, by, -h)) / (2.0 * h)).eval();
    for (int k = 0; k < 8; ++k) {
        const bool is_direction = 3 <= k && k < 6;
        EXPECT_NEAR(numbers(*end)[k].value, here[k], is_direction ? 1e-14 : 1e-11) << name;  // roundings alone
        EXPECT_NEAR(numbers(*end)[k].slope, difference[k], is_direction ? 2e-9 : 4e-6) << name << ", number " << k;
    }
}

}  // namespace

TEST(ReplayDerivative, OfEveryPoseIsThatOfDifferences) {
    for (const unsigned seed : {1u, 2u, 5u}) {
        const Bench bench(seed);
        const std::vector<int> ends{Bench::plate,  Bench::wedge,  Bench::prism,
                                    Bench::mirror, Bench::screen, Bench::faces};
        for (int axis = 0; axis < 3; ++axis) {
            const Vector3d e = Vector3d::Unit(axis);
            for (std::size_t body = 0; body + 1 < ends.size(); ++body) {
                const std::string name = "body " + std::to_string(body) + ", axis " + std::to_string(axis);
                const Vector3d about(3.0, -2.0, 50.0 * double(body));
                expect_slopes_are_differences(bench, {ends[body], ends[body + 1], turning(e, about)},
                                              name + ", rotation");
                expect_slopes_are_differences(bench, {ends[body], ends[body + 1], shifting(e)}, name + ", shift");
            }
            expect_slopes_are_differences(bench, {0, 0, {}, turning(e, {1.0, 2.0, -30.0})}, "source's rotation");
            expect_slopes_are_differences(bench, {0, 0, {}, shifting(e)}, "source's shift");
        }
    }
}

TEST(ReplayDerivative, OfIndicesIsThatOfDifferences) {
    expect_slopes_are_differences(Bench(1), {0, 0, {}, {}, 1.0, 0.0}, "glass");
    expect_slopes_are_differences(Bench(1), {0, 0, {}, {}, 0.0, 1.0}, "air");
}

TEST(ReplayDerivative, ReflectedBeamTurnsByTwiceTheMirrorsTilt) {
    const double distance = 750.0;
    RecordedRoute recorded;
    recorded.meet(Event::reflected,
                  make_rectangle({0, 0, distance}, Matrix3d::Identity(), {50, 50}, Surface::reflecting), 1.0, 1.0);
    recorded.meet(Event::absorbed, make_rectangle({0, 0, 0}, Matrix3d::Identity(), {50, 50}, Surface::absorbing), 1.0,
                  1.0);
    const RigidRate tilt = turning(Vector3d::UnitX(), {0, 0, distance});
    const std::vector<DualEncounter> route{
        {Event::reflected, true, moving(recorded.frames[0], tilt), &recorded.outlines[0], {1.0}, {1.0}},
        {Event::absorbed, true, moving(recorded.frames[1]), &recorded.outlines[1], {1.0}, {1.0}}};
    const auto end = replay(route, moving(Ray{{0, 0, 0}, {0, 0, 1}}), gap);
    ASSERT_TRUE(end);
    EXPECT_EQ(end->direction[1].slope, 2.0);  // about +x the normal +z turns towards -y, the beam back towards +y
    EXPECT_EQ(end->point[1].slope, 2.0 * distance);
    EXPECT_EQ(end->point[0].slope, 0.0);
    EXPECT_EQ(end->optical_length.value, 2.0 * distance);
    EXPECT_EQ(end->optical_length.slope, 0.0);  // it grows with the square of the tilt
}

TEST(ReplayDerivative, TiltedPlateDisplacesByItsClosedForm) {
    // Displacement D = T sin a (1 - cos a / q), q = sqrt(n^2 - sin^2 a), at a large tilt.
    const double tilt = 0.3, thickness = 12.0, n = 1.5;
    const Matrix3d turn = stepdiag::rotation_exp({0, tilt, 0});
    const auto plate = stepdiag::make_plate(60, 60, thickness, {n}, {{0, 0, 50}, turn});
    auto faces = plate;
    faces.push_back(make_rectangle({0, 0, 100}, Matrix3d::Identity(), {50, 50}, Surface::absorbing));
    const stepdiag::Scene scene(faces);
    const Ray ray{{0, 0, 0}, {0, 0, 1}};
    const RecordedRoute recorded(scene, {1.0}, ray, trace(scene, {1.0}, ray));
    ASSERT_EQ(recorded.route.size(), 3u);
    const auto derivative = [&](const RigidRate& motion, double index_rate) {
        std::vector<DualEncounter> route;
        for (std::size_t i = 0; i < 3; ++i)
            route.push_back({recorded.route[i].event, true, moving(recorded.frames[i], i < 2 ? motion : RigidRate{}),
                             &recorded.outlines[i], Dual{i == 1 ? n : 1.0, i == 1 ? index_rate : 0.0},
                             Dual{i == 0 ? n : 1.0, i == 0 ? index_rate : 0.0}});
        return *replay(route, moving(ray), gap);
    };
    const double s = std::sin(tilt), c = std::cos(tilt), q = std::sqrt(n * n - s * s);
    const auto by_tilt = derivative(turning(Vector3d::UnitY(), {0, 0, 50}), 0.0);
    const auto by_index = derivative({}, 1.0);
    // The beam moves towards +x, where the normal leans; a dozen roundings of 50 mm.
    EXPECT_NEAR(by_tilt.point[0].value, thickness * s * (1.0 - c / q), 1e-13);
    EXPECT_NEAR(by_tilt.point[0].slope, thickness * (c - (c * c - s * s) / q - s * s * c * c / (q * q * q)), 1e-12);
    EXPECT_NEAR(by_tilt.direction[0].slope, 0.0, 1e-14);  // parallel faces turn no beam
    EXPECT_NEAR(by_index.point[0].slope, thickness * s * c * n / (q * q * q), 1e-13);
    // Optical path of a plane plate: T (q - c) and what there would be without it.
    EXPECT_NEAR(by_index.optical_length.slope, thickness * n / q, 1e-12);
    EXPECT_NEAR(by_tilt.optical_length.slope, thickness * (s - s * c / q), 1e-12);
}

TEST(ReplayDerivative, FailedCheckGivesNothing) {
    const Bench bench;
    const RecordedRoute recorded = bench.record();
    auto route = with_slopes(recorded, bench, {});
    route[2].event = Event::totally_reflected;
    EXPECT_FALSE(replay(route, moving(bench.ray), gap));
}
