#include "stepdiag/head/head.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/plan/line.hpp"
#include "support/refuses.hpp"
#include "support/traced_mirror.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Head;
using stepdiag::HeadLayout;
using stepdiag::HeadSetup;
using stepdiag::SignalRow;
using stepdiag::test::trace_signals;

const Vector3d volume(800.0, 600.0, 500.0);
const Vector2d mirror(80.0, 80.0);

Matrix3d frame(const char* line) { return stepdiag::line_frame(stepdiag::Line::parse(line), volume); }

Head multi_beam(std::vector<Vector2d> offsets) {
    Head head;
    head.layout = HeadLayout::multi_beam;
    head.beam_offsets = std::move(offsets);
    return head;
}

Head psd(double distance) {
    Head head;
    head.layout = HeadLayout::psd;
    head.psd_distance = distance;
    return head;
}

const std::vector<Head> one_of_every_layout = {Head{}, psd(50.0), multi_beam({{1, -2}, {20, 0}, {-10, 20}, {-9, -18}})};

SignalRow read(const Head& head, const HeadSetup& setup, const Vector3d& point,
               const Matrix3d& turn = Matrix3d::Identity()) {
    return define_signals(head, mirror_in_sensor_frame(setup, point, turn), setup.mirror);
}

}  // namespace

TEST(Head, AlignedMirrorReadsStandoffAndTravel) {
    const Head head;
    const Matrix3d f = frame("pnp");
    const Vector3d start(0.0, 600.0, 0.0);
    const auto setup = set_up(head, f, start, mirror, {});
    for (const double travel : {0.0, 10.0, 1118.0}) {
        const SignalRow row = read(head, setup, start + travel * f.col(2));
        EXPECT_NEAR(row[0].value(), 100.0 + travel, 2e-12);  // roundings of coordinates of 1000 mm
        EXPECT_NEAR(row[1].value(), 0.0, 1e-15);
        EXPECT_NEAR(row[2].value(), 0.0, 1e-15);
    }
}

TEST(Head, TiltsFollowToolReflectorAndLaserToFirstOrder) {
    const Head head;
    const Matrix3d f = frame("ppp");
    const Vector3d tool_turn(3e-6, -5e-6, 7e-6);
    const Vector2d reflector(20e-6, -30e-6), laser(-40e-6, 10e-6);
    const auto setup = set_up(head, f, Vector3d::Zero(), mirror, {reflector, laser, Vector2d::Zero()});
    const SignalRow row = read(head, setup, 200.0 * f.col(2), stepdiag::rotation_exp(tool_turn));
    const Vector2d expected = (f.transpose() * tool_turn).head<2>() + reflector - laser;
    EXPECT_NEAR(row[1].value(), expected.x(), 5e-9);  // second order: products of 50 urad
    EXPECT_NEAR(row[2].value(), expected.y(), 5e-9);
}

TEST(Head, SignalsOfEveryLayoutAreThoseOfTheTrace) {
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto pair = [&](double size) { return Vector2d(size * unit(engine), size * unit(engine)); };
    const auto triple = [&](double size) {
        return Vector3d(size * unit(engine), size * unit(engine), size * unit(engine));
    };
    for (const Head& head : one_of_every_layout)
        for (const char* line : {"ppp", "npp", "pnp", "nnp", "ppn", "nnn", "pp0", "0np", "p00", "00p", "00n"}) {
            const Matrix3d f = frame(line);
            for (int i = 0; i < 100; ++i) {
                const Vector3d start = 500.0 * triple(1.0);
                const auto setup = set_up(head, f, start, {100.0, 100.0}, {pair(1e-3), pair(1e-3)});
                const Vector3d point =
                    start + (600.0 + 550.0 * unit(engine)) * f.col(2) + f.leftCols<2>() * pair(15.0) + triple(0.05);
                const Matrix3d turn = stepdiag::rotation_exp(triple(200e-6));
                const SignalRow traced = trace_signals(head, setup, point, turn);
                const SignalRow closed = read(head, setup, point, turn);
                ASSERT_EQ(traced.size(), closed.size());
                for (std::size_t c = 0; c < traced.size(); ++c) {
                    const bool tilt = head.layout == HeadLayout::ideal && c > 0;
                    // Roundings of unit vectors, and of coordinates of 1500 mm; spots have both, over 2.5 m of path.
                    EXPECT_NEAR(closed[c].value(), traced[c].value(), tilt ? 1e-14 : 1e-11);
                }
            }
        }
}

TEST(Head, EveryLayoutLosesItsBeamsWhereTheTraceDoes) {
    std::mt19937_64 engine(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto pair = [&](double size) { return Vector2d(size * unit(engine), size * unit(engine)); };
    const Matrix3d f = frame("npp");
    for (Head head : one_of_every_layout) {
        int read_here = 0, lost = 0, in_part = 0;
        for (int i = 0; i < 3000; ++i) {
            // Mirrors and apertures of some 40 mm, tilts of 10 mrad (16 mm at 0.8 m), a tenth of the mirrors behind the
            // head.
            head.aperture = 30.0 + 20.0 * unit(engine);
            const Vector2d size = Vector2d(40.0, 60.0) + pair(10.0);
            const auto setup = set_up(head, f, Vector3d::Zero(), size,
                                      {pair(0.01), pair(0.01), Vector2d::Zero(), 0.0, {}, pair(5.0), unit(engine)});
            const double ahead = 420.0 + 400.0 * unit(engine);  // of the head
            const double behind = i % 10 == 0 ? -1.0 : 1.0;
            const Vector3d point = f * Vector3d(15.0 * unit(engine), 15.0 * unit(engine), behind * ahead - 100.0);
            const Matrix3d turn =
                stepdiag::rotation_exp(f * Vector3d(0.01 * unit(engine), 0.01 * unit(engine), unit(engine)));
            const SignalRow traced = trace_signals(head, setup, point, turn), closed = read(head, setup, point, turn);
            std::size_t count = 0;
            for (std::size_t c = 0; c < traced.size(); ++c) {
                EXPECT_EQ(closed[c].has_value(), traced[c].has_value()) << i << " " << c;
                count += traced[c].has_value();
            }
            (count == traced.size() ? read_here : count == 0 ? lost : in_part) += 1;
        }
        EXPECT_GT(read_here, 300);
        EXPECT_GT(lost, 100);
        if (head.layout == HeadLayout::multi_beam) EXPECT_GT(in_part, 300);
        else EXPECT_EQ(in_part, 0);
    }
}

TEST(Head, BeamThatMissesTheMirrorIsALostReading) {
    const Matrix3d f = frame("p00");
    for (const Head& head : {Head{}, psd(50.0)}) {
        const auto setup = set_up(head, f, Vector3d::Zero(), {20.0, 10.0}, {});
        const auto beside = [&](double x, double y) { return read(head, setup, f * Vector3d(x, y, 300.0))[0]; };
        EXPECT_TRUE(beside(9.9, 0.0));
        EXPECT_FALSE(beside(10.1, 0.0));
        EXPECT_TRUE(beside(0.0, -4.9));
        EXPECT_FALSE(beside(0.0, -5.1));
        EXPECT_FALSE(read(head, setup, f * Vector3d(0, 0, -400.0))[0]);  // behind the head
    }
    const Head beams = multi_beam({{0, 0}, {20, 0}, {0, 20}});
    const auto setup = set_up(beams, f, Vector3d::Zero(), {44.0, 44.0}, {});
    const auto lost = [&](double x, double y) {
        std::string text;
        for (const auto& signal : read(beams, setup, f * Vector3d(x, y, 300.0))) text += signal ? '.' : 'x';
        return text;
    };
    EXPECT_EQ(lost(0.0, 0.0), "...");  // the mirror reaches 22 mm to every side
    EXPECT_EQ(lost(-3.0, 0.0), ".x.");
    EXPECT_EQ(lost(0.0, -3.0), "..x");
    EXPECT_EQ(lost(23.0, 0.0), "x.x");
}

TEST(Head, BeamThatDoesNotComeBackToTheHeadIsALostReading) {
    const Matrix3d f = frame("p00");
    for (const Head& head : one_of_every_layout) {  // the aperture takes 25 mm to every side of a beam's start
        const auto setup = set_up(head, f, Vector3d::Zero(), {100.0, 100.0}, {});
        const auto tilted = [&](double angle) {
            return read(head, setup, 900.0 * f.col(2), stepdiag::rotation_exp(f.col(0) * angle));
        };
        // Returns 2 * 0.0122 * 1000 mm = 24.4 mm off, and 0.5 mm more or less of beams 20 mm away; then 25.6 mm.
        for (const auto& signal : tilted(0.0122)) EXPECT_TRUE(signal);
        for (const auto& signal : tilted(0.0128)) EXPECT_FALSE(signal);
    }
}

TEST(Head, SignalsOfRawLayoutsAreTheirDefinitions) {
    const Matrix3d f = frame("ppp");
    const Head by_spot = psd(50.0);
    const auto setup = set_up(by_spot, f, Vector3d::Zero(), mirror, {});
    const auto seen = mirror_in_sensor_frame(setup, 900.0 * f.col(2), stepdiag::rotation_exp(f.col(0) * 1e-6));
    const auto reading = stepdiag::read_mirror(seen.point, seen.rotation.col(2)).value();
    const auto values = signals(by_spot, reading);
    EXPECT_EQ(signal_names(by_spot), (std::vector<std::string>{"distance", "spot_x", "spot_y"}));
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
