#include "stepdiag/head/head.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/plan/line.hpp"
#include "support/refuses.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Head;
using stepdiag::HeadLayout;
using stepdiag::Medium;
using stepdiag::Misalignment;

const Vector3d volume(800.0, 600.0, 500.0);
const Vector2d mirror(80.0, 80.0);

Matrix3d frame(const char* line) { return stepdiag::line_frame(stepdiag::Line::parse(line), volume); }

Head multi_beam(std::vector<Vector2d> offsets) {
    Head head;
    head.layout = HeadLayout::multi_beam;
    head.beam_offsets = std::move(offsets);
    return head;
}

}  // namespace

TEST(Head, AlignedMirrorReadsStandoffAndTravel) {
    const Head head;
    const Matrix3d f = frame("pnp");
    const Vector3d start(0.0, 600.0, 0.0);
    const auto setup = set_up(head, f, start, mirror, {});
    for (const double travel : {0.0, 10.0, 1118.0}) {
        const auto reading =
            trace_reading(head, setup, start + travel * f.col(2), Matrix3d::Identity(), Medium{1.0003});
        ASSERT_TRUE(reading);
        EXPECT_NEAR(reading->distance, 100.0 + travel, 2e-12);  // roundings of coordinates of 1000 mm
        EXPECT_NEAR(reading->alpha, 0.0, 1e-15);
        EXPECT_NEAR(reading->beta, 0.0, 1e-15);
    }
}

TEST(Head, TiltsFollowToolReflectorAndLaserToFirstOrder) {
    const Head head;
    const Matrix3d f = frame("ppp");
    const Vector3d tool_turn(3e-6, -5e-6, 7e-6);
    const Vector2d reflector(20e-6, -30e-6), laser(-40e-6, 10e-6);
    const auto setup = set_up(head, f, Vector3d::Zero(), mirror, {reflector, laser, Vector2d::Zero()});
    const auto reading = trace_reading(head, setup, 200.0 * f.col(2), stepdiag::rotation_exp(tool_turn), Medium{});
    ASSERT_TRUE(reading);
    const Vector2d expected = (f.transpose() * tool_turn).head<2>() + reflector - laser;
    EXPECT_NEAR(reading->alpha, expected.x(), 5e-9);  // second order: products of 50 urad
    EXPECT_NEAR(reading->beta, expected.y(), 5e-9);
}

TEST(Head, TracedReadingIsTheClosedDefinition) {
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const Head head;
    for (const char* line : {"ppp", "npp", "pnp", "nnp", "ppn", "nnn", "pp0", "0np", "p00", "00p", "00n"}) {
        const Matrix3d f = frame(line);
        for (int i = 0; i < 100; ++i) {
            const auto pair = [&](double size) { return Vector2d(size * unit(engine), size * unit(engine)); };
            const auto triple = [&](double size) {
                return Vector3d(size * unit(engine), size * unit(engine), size * unit(engine));
            };
            const Vector3d start = 500.0 * triple(1.0);
            const auto setup = set_up(head, f, start, mirror, {pair(1e-3), pair(1e-3), Vector2d::Zero()});
            const Vector3d point =
                start + (600.0 + 550.0 * unit(engine)) * f.col(2) + f.leftCols<2>() * pair(15.0) + triple(0.05);
            const Matrix3d turn = stepdiag::rotation_exp(triple(200e-6));
            const auto traced = trace_reading(head, setup, point, turn, Medium{1.000268});
            const auto closed = define_reading(setup, point, turn);
            ASSERT_TRUE(traced && closed);
            EXPECT_NEAR(traced->distance, closed->distance, 5e-12);  // roundings of coordinates of 1500 mm
            EXPECT_NEAR(traced->alpha, closed->alpha, 1e-14);        // roundings of unit vectors
            EXPECT_NEAR(traced->beta, closed->beta, 1e-14);
        }
    }
}

TEST(Head, BeamThatMissesTheMirrorIsALostReading) {
    const Head head;
    const Matrix3d f = frame("p00");
    const auto setup = set_up(head, f, Vector3d::Zero(), {20.0, 10.0}, {});
    const auto beside = [&](double x, double y) {
        return trace_reading(head, setup, f * Vector3d(x, y, 300.0), Matrix3d::Identity(), Medium{}).has_value();
    };
    EXPECT_TRUE(beside(9.9, 0.0));
    EXPECT_FALSE(beside(10.1, 0.0));
    EXPECT_TRUE(beside(0.0, -4.9));
    EXPECT_FALSE(beside(0.0, -5.1));
    EXPECT_FALSE(
        trace_reading(head, setup, f * Vector3d(0, 0, -400.0), Matrix3d::Identity(), Medium{}));  // behind the head
}

TEST(Head, BeamThatDoesNotComeBackToTheHeadIsALostReading) {
    const Head head;  // its aperture takes 25 mm to every side
    const Matrix3d f = frame("p00");
    const auto setup = set_up(head, f, Vector3d::Zero(), mirror, {});
    const auto tilted = [&](double angle) {
        return trace_reading(head, setup, f * Vector3d(0, 0, 900.0), stepdiag::rotation_exp(f.col(0) * angle), Medium{})
            .has_value();
    };
    EXPECT_TRUE(tilted(0.0124));   // returns 2 * 0.0124 * 1000 mm = 24.8 mm off
    EXPECT_FALSE(tilted(0.0126));  // 25.2 mm off
}

TEST(Head, SignalsOfRawLayoutsAreTheirDefinitions) {
    Head psd;
    psd.layout = HeadLayout::psd;
    psd.psd_distance = 50.0;
    const Matrix3d f = frame("ppp");
    const auto setup = set_up(psd, f, Vector3d::Zero(), mirror, {});
    const auto reading = *define_reading(setup, 900.0 * f.col(2), stepdiag::rotation_exp(f.col(0) * 1e-6));
    const auto values = signals(psd, reading);
    EXPECT_EQ(signal_names(psd), (std::vector<std::string>{"distance", "spot_x", "spot_y"}));
    EXPECT_NEAR(values[0], 1000.0, 1e-8);  // second order: 1e-12 of it
    EXPECT_NEAR(values[1], 0.0, 1e-12);
    EXPECT_NEAR(values[2], 2.0 * 1050.0 * 1e-6, 1e-12);

    const Head beams = multi_beam({{0, 0}, {20, 0}, {0, 20}});
    const auto d = signals(beams, reading);
    EXPECT_EQ(signal_names(beams), (std::vector<std::string>{"d1", "d2", "d3"}));
    EXPECT_NEAR(d[2] - d[0], 20.0 * 1e-6, 1e-12);  // alpha lifts the mirror at +v
    EXPECT_NEAR(d[1] - d[0], 0.0, 1e-12);
}

TEST(Head, NamesOfLayoutsAreReadBack) {
    for (const char* text : {"ideal", "psd", "multi_beam"}) EXPECT_EQ(name(stepdiag::parse_head_layout(text)), text);
    for (const char* text : {"", "Ideal", "a", "multibeam"})
        expect_refused([&] { stepdiag::parse_head_layout(text); }, "layout");
}

TEST(Head, WhatMakesNoHeadIsRefusedByItsKey) {
    constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
    const auto change = [](auto edit) {
        Head head;
        edit(head);
        return [head] { check_head(head); };
    };
    for (const double length : {0.0, -1.0, undefined, double(INFINITY)}) {
        expect_refused(change([&](Head& h) { h.standoff = length; }), "standoff");
        expect_refused(change([&](Head& h) { h.wavelength = length; }), "wavelength");
        expect_refused(change([&](Head& h) { h.aperture = length; }), "aperture");
        expect_refused(change([&](Head& h) { h.mirror = Vector2d(50.0, length); }), "mirror");
    }
    for (const double length : {-100.0, undefined, double(INFINITY)})
        expect_refused(change([&](Head& h) { h.layout = HeadLayout::psd, h.psd_distance = length; }), "psd_distance");
    const auto beams = [](std::vector<Vector2d> offsets) { return [offsets] { check_head(multi_beam(offsets)); }; };
    expect_refused(beams({}), "beam_offsets");
    expect_refused(beams({{0, 0}, {10, 0}}), "beam_offsets");
    expect_refused(beams({{0, 0}, {10, 0}, {20, 0}}), "beam_offsets");
    expect_refused(beams({{5, 5}, {5, 5}, {5, 5}}), "beam_offsets");
    expect_refused(beams({{0, 0}, {10, 0}, {0, undefined}}), "beam_offsets");
    expect_refused(beams({{0, 0}, {10, 0}, {0, INFINITY}}), "beam_offsets");
    EXPECT_NO_THROW(beams({{0, 0}, {10, 0}, {0, 10}})());
}
