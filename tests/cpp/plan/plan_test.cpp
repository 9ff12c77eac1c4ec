#include "stepdiag/plan/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Axis;
using stepdiag::Line;
using stepdiag::Plan;
using stepdiag::test::diagonals;
using stepdiag::test::lines;
using stepdiag::test::volume;

std::vector<Vector3d> commanded(const Plan& plan, const char* line) {
    std::vector<Vector3d> positions;
    for (const auto& point : plan.points(Line::parse(line))) positions.push_back(point.commanded);
    return positions;
}

}  // namespace

TEST(Plan, PointsOfTwoStepsAreThoseWrittenByHand) {
    const Plan plan({8.0, 6.0, 4.0}, lines({"ppp", "npn", "0pn", "00n", "p00"}), 2, stepdiag::parse_order("YZX"));
    using List = std::vector<Vector3d>;
    EXPECT_EQ(commanded(plan, "ppp"),
              (List{{0, 0, 0}, {0, 3, 0}, {0, 3, 2}, {4, 3, 2}, {4, 6, 2}, {4, 6, 4}, {8, 6, 4}}));
    EXPECT_EQ(commanded(plan, "npn"),
              (List{{8, 0, 4}, {8, 3, 4}, {8, 3, 2}, {4, 3, 2}, {4, 6, 2}, {4, 6, 0}, {0, 6, 0}}));
    EXPECT_EQ(commanded(plan, "0pn"), (List{{0, 0, 4}, {0, 3, 4}, {0, 3, 2}, {0, 6, 2}, {0, 6, 0}}));
    EXPECT_EQ(commanded(plan, "00n"), (List{{0, 0, 4}, {0, 0, 2}, {0, 0, 0}}));
    EXPECT_EQ(commanded(plan, "p00"), (List{{0, 0, 0}, {4, 0, 0}, {8, 0, 0}}));
}

TEST(Plan, NumberOfPointsFollowsTheMovedAxes) {
    for (const int n : {1, 2, 7, 50}) {
        const Plan plan(volume, lines({"nnn", "p0n", "0n0"}), n, stepdiag::all_axes, lines({"p00"}));
        EXPECT_EQ(plan.points(Line::parse("nnn")).size(), 3u * n + 1);
        EXPECT_EQ(plan.points(Line::parse("p0n")).size(), 2u * n + 1);
        EXPECT_EQ(plan.points(Line::parse("0n0")).size(), 1u * n + 1);
        EXPECT_EQ(plan.points(Line::parse("p00")).size(), 2u);
    }
}

TEST(Plan, EveryPointSaysWhatMovedAndWhichNodesItIsOn) {
    const Plan plan(volume, lines({"pnp"}), 5, stepdiag::parse_order("ZXY"));
    const auto points = plan.points(Line::parse("pnp"));
    EXPECT_FALSE(points[0].moved);
    for (std::size_t k = 1; k < points.size(); ++k) {
        EXPECT_EQ(points[k].moved, plan.order()[(k - 1) % 3]);
        for (const Axis axis : stepdiag::all_axes) {
            const int before = points[k - 1].node[index(axis)];
            const int step = points[k].moved == axis ? Line::parse("pnp").sign(axis) : 0;
            EXPECT_EQ(points[k].node[index(axis)], before + step);
            EXPECT_EQ(points[k].commanded[index(axis)], plan.nodes(axis)[points[k].node[index(axis)]]);
        }
    }
    EXPECT_EQ(points.back().commanded, Vector3d(800.0, 0.0, 500.0));
}

TEST(Plan, ScaleLineHasItsTwoEnds) {
    const Plan plan(volume, lines({"ppp"}), 50, stepdiag::all_axes, lines({"p00", "0n0"}));
    EXPECT_EQ(commanded(plan, "p00"), (std::vector<Vector3d>{{0, 0, 0}, {800, 0, 0}}));
    EXPECT_EQ(commanded(plan, "0n0"), (std::vector<Vector3d>{{0, 600, 0}, {0, 0, 0}}));
}

TEST(Plan, BeamWandersElevenMillimetresOnTheMirrorForStepsOf16By12By10) {
    // A 16 x 12 x 10 mm step of the ppp line: 11.2 mm off the diagonal after X, 8.9 mm before Z (to the digits
    // printed).
    const Plan plan(volume, lines({"ppp"}), 50);
    const auto f = plan.frame(Line::parse("ppp"));
    const auto off = [&](const Vector3d& travel) { return (f.leftCols<2>().transpose() * travel).norm(); };
    EXPECT_NEAR(off({16.0, 0.0, 0.0}), 11.2, 0.05);
    EXPECT_NEAR(off({16.0, 12.0, 0.0}), 8.9, 0.05);
    EXPECT_NEAR(off({16.0, 12.0, 10.0}), 0.0, 1e-14);  // back on the diagonal, to roundings of 20 mm

    const auto excursion = plan.lateral_excursion(Line::parse("ppp"));
    // Local x: 16 * 0.6 = 9.6 after X, 0 after Y. Local y: 16*0.8*500/1118.03 after X, 20*500/1118.03 after Y.
    const double D = std::sqrt(1.25e6);
    EXPECT_LE((excursion.lowest - Vector2d(0.0, 0.0)).norm(), 1e-14);
    EXPECT_LE((excursion.highest - Vector2d(9.6, 20.0 * 500.0 / D)).norm(), 1e-14);
    EXPECT_LE((plan.smallest_mirror() - 2.0 * Vector2d(9.6, 20.0 * 500.0 / D)).norm(), 2e-14);
}

TEST(Plan, ScaleLinesAreReadAtTheirEndsOrAtEveryStep) {
    const auto plan = [](int steps, stepdiag::ScalePoints points) {
        return Plan(volume, lines({"ppp"}), steps, stepdiag::all_axes, lines({"n00"}), {1, 1}, points);
    };
    const Line line = Line::parse("n00");
    const auto ends = plan(4, stepdiag::ScalePoints::ends).points(line);
    ASSERT_EQ(ends.size(), 2u);
    EXPECT_EQ(ends[0].commanded, Vector3d(800.0, 0.0, 0.0));
    EXPECT_EQ(ends[1].commanded, Vector3d(0.0, 0.0, 0.0));
    EXPECT_EQ(ends[1].number, 1);
    const auto steps = plan(4, stepdiag::ScalePoints::steps).points(line);
    ASSERT_EQ(steps.size(), 5u);  // no returns to a check point
    for (int k = 0; k <= 4; ++k) {
        EXPECT_EQ(steps[std::size_t(k)].number, k);
        EXPECT_EQ(steps[std::size_t(k)].node, (std::array{4 - k, 0, 0}));
        EXPECT_EQ(steps[std::size_t(k)].commanded, Vector3d(800.0 - 200.0 * k, 0.0, 0.0));
    }
    EXPECT_EQ(plan(1, stepdiag::ScalePoints::steps).points(line).size(), 2u);
    EXPECT_EQ(stepdiag::parse_scale_points("steps"), stepdiag::ScalePoints::steps);
    expect_refused([] { stepdiag::parse_scale_points("step"); }, "scale_points: expected \"ends\" or \"steps\"");
    expect_refused([] { Plan(volume, diagonals, 4, stepdiag::all_axes, {}, {}, stepdiag::ScalePoints::steps); },
                   "scale_points: expected scale_lines as well");
}

TEST(Plan, StepsInBlocksFollowEachOtherOnOneAxis) {
    const auto plan = [](int block, const stepdiag::CheckPoints& check = {}) {
        return Plan(volume, lines({"npp"}), 5, stepdiag::all_axes, {}, check, stepdiag::ScalePoints::ends, block);
    };
    const Line line = Line::parse("npp");
    std::string moved;
    for (const auto& point : plan(2).points(line))
        if (point.moved) moved += stepdiag::letter(*point.moved);
    EXPECT_EQ(moved, "XXYYZZXXYYZZXYZ");
    const auto points = plan(2).points(line);
    EXPECT_EQ(points[3].node, (std::array{3, 1, 0}));
    EXPECT_EQ(points.back().node, (std::array{0, 5, 5}));
    for (std::size_t k = 0; k < points.size(); ++k) EXPECT_EQ(points[k].number, int(k));
    // Of blocks that hold no whole number of returns, one after each in which one is due.
    std::vector<std::size_t> returns;
    const auto checked = plan(2, {3, 1}).points(line);
    for (std::size_t k = 0; k < checked.size(); ++k)
        if (checked[k].is_check) returns.push_back(k);
    EXPECT_EQ(returns, (std::vector<std::size_t>{13}));
    EXPECT_LE((plan(2).smallest_mirror() - 2.0 * plan(1).smallest_mirror()).norm(), 1e-12);
    for (const int block : {0, 6}) expect_refused([&] { plan(block); }, "block: expected 1 to 5");
}

TEST(Plan, SmallestMirrorHoldsTheBeamOnEveryLine) {
    const auto names = {"ppp", "npp", "pnp", "nnp", "ppn", "nnn", "p0p", "0np", "pp0"};
    for (const char* order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
        const Plan plan(volume, lines(names), 4, stepdiag::parse_order(order));
        Vector2d largest = Vector2d::Zero();
        for (const char* name : names) {
            const auto positions = commanded(plan, name);
            const auto f = plan.frame(Line::parse(name));
            for (const auto& p : positions)
                largest = largest.cwiseMax((f.leftCols<2>().transpose() * (p - positions.front())).cwiseAbs());
        }
        EXPECT_LE((plan.smallest_mirror() - 2.0 * largest).norm(), 1e-11) << order;  // roundings of 1100 mm
    }
}

TEST(Plan, SingleAxisLinesNeedNoMirrorToSpeakOf) {
    EXPECT_LE(Plan(volume, lines({"p00", "00n"}), 10).smallest_mirror().norm(), 1e-14);
}

TEST(Plan, RunsTakeTheirOrdersInTurn) {
    const std::vector orders{stepdiag::parse_order("XYZ"), stepdiag::parse_order("ZXY")};
    const Plan both(volume, lines({"ppp", "np0"}), 3, orders, lines({"p00"}));
    EXPECT_EQ(both.order(), orders[0]);
    for (int run = -2; run < 5; ++run) {
        const auto& order = orders[run % 2 != 0];
        const Plan one(volume, lines({"ppp", "np0"}), 3, order, lines({"p00"}));
        EXPECT_EQ(both.order(run), order) << run;
        for (const char* name : {"ppp", "np0", "p00"}) {
            const auto points = both.points(Line::parse(name), run), expected = one.points(Line::parse(name));
            ASSERT_EQ(points.size(), expected.size());
            for (std::size_t k = 0; k < points.size(); ++k) {
                EXPECT_EQ(points[k].node, expected[k].node);
                EXPECT_EQ(points[k].moved, expected[k].moved);
            }
        }
    }
}

TEST(Plan, ReturnsToACheckPointStandWhereTheyAreMade) {
    const Plan plan(volume, lines({"npp", "pp0"}), 4, stepdiag::all_axes, lines({"p00"}), {2, 1});
    const auto points = plan.points(Line::parse("npp"));
    ASSERT_EQ(points.size(), 15u);
    for (std::size_t k = 0; k < points.size(); ++k) {
        EXPECT_EQ(points[k].number, int(k));
        EXPECT_EQ(points[k].is_check, k == 7 || k == 14);
        EXPECT_EQ(points[k].moved.has_value(), k != 0 && !points[k].is_check);
    }
    EXPECT_EQ(points[7].node, (std::array{3, 1, 1}));
    EXPECT_EQ(points[7].commanded, Vector3d(600.0, 150.0, 125.0));
    EXPECT_EQ(points[8].node, (std::array{1, 2, 2}));
    EXPECT_EQ(plan.points(Line::parse("pp0")).size(), 11u);
    EXPECT_EQ(plan.points(Line::parse("p00")).size(), 2u);
    // Where the line is at its check point anyway, there is nothing to return from.
    EXPECT_EQ(Plan(volume, diagonals, 4, stepdiag::all_axes, {}, {1, 4}).points(diagonals[0]).size(), 13u);
    expect_refused([&] { Plan(volume, diagonals, 4, stepdiag::all_axes, {}, {5, 0}); }, "check_points every");
    expect_refused([&] { Plan(volume, diagonals, 4, stepdiag::all_axes, {}, {1, -1}); }, "check_points at");
}

TEST(Plan, SmallestMirrorHoldsTheBeamInEveryOrder) {
    const auto size = [](std::vector<stepdiag::StepOrder> orders) {
        return Plan(volume, lines({"ppp", "npp"}), 4, std::move(orders)).smallest_mirror();
    };
    const auto xyz = stepdiag::parse_order("XYZ"), zyx = stepdiag::parse_order("ZYX");
    EXPECT_EQ(size({xyz, zyx}), size({xyz}).cwiseMax(size({zyx})));
}

TEST(Plan, WhatMakesNoPlanIsRefused) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const auto make = [](Vector3d edges, std::vector<Line> l, int steps, std::vector<Line> scale = {}) {
        Plan(edges, std::move(l), steps, stepdiag::all_axes, std::move(scale));
    };
    expect_refused([&] { make({0.0, 600.0, 500.0}, diagonals, 5); }, "volume");
    expect_refused([&] { make({800.0, -600.0, 500.0}, diagonals, 5); }, "volume");
    expect_refused([&] { make({800.0, 600.0, nan}, diagonals, 5); }, "volume");
    expect_refused([&] { make({INFINITY, 600.0, 500.0}, diagonals, 5); }, "volume");
    expect_refused([&] { make({800.0, 600.0, 1e-200}, diagonals, 5); }, "volume");  // its square is no longer a number
    expect_refused([&] { make(volume, diagonals, 0); }, "steps");
    expect_refused([&] { make(volume, diagonals, -3); }, "steps");
    expect_refused([&] { make(volume, diagonals, 1'000'000'000); }, "steps");
    expect_refused([&] { make(volume, {}, 5); }, "lines");
    expect_refused([&] { make(volume, lines({"ppp", "ppp"}), 5); }, "lines: \"ppp\"");
    expect_refused([&] { make(volume, lines({"ppp", "p00"}), 5, lines({"p00"})); }, "\"p00\"");
    expect_refused([&] { make(volume, diagonals, 5, lines({"pp0"})); }, "scale_lines");
    expect_refused([&] { Plan(volume, diagonals, 5, std::vector<stepdiag::StepOrder>{}); }, "order");
    expect_refused([&] { Plan(volume, diagonals, 5).points(Line::parse("ppn")); }, "\"ppn\"");
    for (const char* order : {"", "XY", "XYY", "xyz", "XYZX", "ABC"})
        expect_refused([&] { stepdiag::parse_order(order); }, "order \"" + std::string(order) + "\"");
}
