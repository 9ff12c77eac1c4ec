#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "stepdiag/machine/machine.hpp"
#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using stepdiag::Axis;
using stepdiag::Chain;
using stepdiag::ErrorMap;
using stepdiag::Machine;
using stepdiag::test::volume;

ErrorMap random_map(double scale) {
    stepdiag::RandomErrorMap options;
    options.seed = 11;
    options.translation = 0.020 * scale;
    options.rotation = 60e-6 * scale;
    options.squareness = 60e-6 * scale;
    options.intervals = 10;
    return stepdiag::make_random_error_map(volume, options);
}

Matrix4d shift(const Vector3d& v) {
    Matrix4d t = Matrix4d::Identity();
    t.topRightCorner<3, 1>() = v;
    return t;
}

Matrix4d turn(const Vector3d& v) {
    Matrix4d t = Matrix4d::Identity();
    if (v.norm() > 0.0) t.topLeftCorner<3, 3>() = Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix();
    return t;
}

Matrix4d before_bed(const ErrorMap& map, Axis a, double p) {
    return turn(map.theta(a, p)) * shift(p * Vector3d::Unit(int(a)) + map.delta(a, p));
}
Matrix4d after_bed(const ErrorMap& map, Axis a, double p) {
    return shift(p * Vector3d::Unit(int(a)) + map.delta(a, p)) * turn(map.theta(a, p));
}

std::vector<Vector3d> commands() {
    return {{0, 0, 0}, {800, 600, 500}, {800, 0, 0}, {0, 600, 0}, {0, 0, 500}, {123.4, 567.8, 91.0}, {400, 300, 250}};
}

const Vector3d tool(-12.0, 7.0, 80.0);

void expect_pose(const char* chain, const std::function<Matrix4d(const ErrorMap&, const Vector3d&)>& product) {
    const ErrorMap map = random_map(1.0);
    const Machine machine(Chain::parse(chain), map, tool);
    for (const Vector3d& c : commands()) {
        const Matrix4d expected = product(map, c) * shift(tool);
        const auto pose = machine.pose(c);
        // 1e-12 mm: a handful of roundings of lengths up to 800 mm (1.1e-13 each); rotations: of numbers up to 1.
        EXPECT_LE((pose.position - expected.topRightCorner<3, 1>()).norm(), 1e-12) << chain;
        EXPECT_LE((pose.rotation - expected.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-15) << chain;
        EXPECT_LE((machine.error(c) - (pose.position - c - tool)).norm(), 1e-12) << chain;
    }
}

TEST(Pose, ExpansionOfAScaleIsATranslationOfItsAxisWithinTheChain) {
    const Vector3d expansion(0.03, -0.02, 0.01);
    for (const char* text : {"[w X' b Y Z t]", "[w b X Y Z t]", "[w Z' Y' X' b t]"})
        for (const Vector3d& p : commands()) {
            stepdiag::ParameterTable longer = random_map(1.0).table();
            for (int a = 0; a < 3; ++a)
                for (double& value : longer.functions[7 * a]->value) value += expansion[a];  // EXX, EYY, EZZ
            const Vector3d tool(10.0, -20.0, 150.0);
            const Machine machine(Chain::parse(text), random_map(1.0), tool),
                other(Chain::parse(text), ErrorMap(longer), tool);
            const stepdiag::Pose found = machine.pose(p, stepdiag::all_positive, expansion), expected = other.pose(p);
            EXPECT_LE((found.position - expected.position).cwiseAbs().maxCoeff(), 1e-12);  // a few roundings of 1 m
            EXPECT_EQ(found.rotation, expected.rotation);
        }
}

}  // namespace

// The products are written out by hand, one a chain.
TEST(Pose, ChainXWorkpieceYZTool) {
    expect_pose("[w X' b Y Z t]", [](const ErrorMap& m, const Vector3d& c) -> Matrix4d {
        return before_bed(m, Axis::X, c.x()) * after_bed(m, Axis::Y, c.y()) * after_bed(m, Axis::Z, c.z());
    });
}
TEST(Pose, ChainAllTool) {
    expect_pose("[w b Z X Y t]", [](const ErrorMap& m, const Vector3d& c) -> Matrix4d {
        return after_bed(m, Axis::Z, c.z()) * after_bed(m, Axis::X, c.x()) * after_bed(m, Axis::Y, c.y());
    });
}
TEST(Pose, ChainTwoWorkpieceOneTool) {
    expect_pose("[w Z' X' b Y t]", [](const ErrorMap& m, const Vector3d& c) -> Matrix4d {
        return before_bed(m, Axis::Z, c.z()) * before_bed(m, Axis::X, c.x()) * after_bed(m, Axis::Y, c.y());
    });
}
TEST(Pose, ChainAllWorkpiece) {
    expect_pose("[w Y' Z' X' b t]", [](const ErrorMap& m, const Vector3d& c) -> Matrix4d {
        return before_bed(m, Axis::Y, c.y()) * before_bed(m, Axis::Z, c.z()) * before_bed(m, Axis::X, c.x());
    });
}

TEST(Pose, FirstOrderErrorDiffersByTheSquareOfTheAmplitude) {
    for (const char* chain : {"[w X' b Y Z t]", "[w b Z X Y t]", "[w Z' X' b Y t]", "[w Y' Z' X' b t]"})
        for (const Vector3d& c : commands()) {
            const auto difference = [&](double scale) {
                const Machine machine(Chain::parse(chain), random_map(scale), tool);
                return Vector3d(machine.error(c) - machine.first_order_error(c));
            };
            const Vector3d whole = difference(10.0), half = difference(5.0);
            // A quarter, but for terms of third order: 10 x 60 urad relative to the second.
            EXPECT_LE((half - 0.25 * whole).norm(), 2e-3 * whole.norm() + 1e-12) << chain << " " << c.transpose();
            // Three pairs of axes and three squares, each up to (sqrt 3 x 60 urad)^2 x 1.2 m = 13 nm.
            EXPECT_LE(difference(1.0).norm(), 6.0 * 13e-6) << chain;
        }
}

TEST(Pose, FirstOrderErrorOfOneAxisIsItsLeverTimesItsRotation) {
    // ECX = 10 urad at x = 800 mm with y = 600 mm beyond it: -6 um in x and, where X carries the workpiece, +8 um in y.
    stepdiag::ParameterTable table;
    table.functions[stepdiag::FunctionId{Axis::X, stepdiag::Component::C}.index()] =
        stepdiag::FunctionTable{{0.0, 800.0}, {0.0, 10e-6}, {std::nullopt, std::nullopt}};
    const ErrorMap map(table);
    const Vector3d c(800.0, 600.0, 0.0);
    const auto error = [&](const char* chain) { return Machine(Chain::parse(chain), map).first_order_error(c); };
    EXPECT_LE((error("[w X' b Y Z t]") - Vector3d(-6e-3, 8e-3, 0.0)).norm(), 1e-17);
    EXPECT_LE((error("[w b X Y Z t]") - Vector3d(-6e-3, 0.0, 0.0)).norm(), 1e-17);
    EXPECT_LE((error("[w b Y X Z t]") - Vector3d(0.0, 0.0, 0.0)).norm(), 1e-17);
    EXPECT_LE((error("[w Y' X' b Z t]") - Vector3d(0.0, 8e-3, 0.0)).norm(), 1e-17);
}

TEST(Pose, ToolThatIsNotFiniteIsRefused) {
    expect_refused([] { Machine(Chain::parse("[w b X Y Z t]"), ErrorMap(), {0.0, std::nan(""), 0.0}); }, "tool");
    expect_refused([] { Machine(Chain::parse("[w b X Y Z t]"), ErrorMap(), {0.0, 0.0, INFINITY}); }, "tool");
}

TEST(Pose, EachAxisHasTheErrorsOfItsOwnApproach) {
    using stepdiag::Approach;
    const ErrorMap positive = random_map(1.0), negative = random_map(0.5);
    stepdiag::ParameterTable table = positive.table();
    table.negative_functions = negative.table().functions;
    for (const char* chain : {"[w X' b Y Z t]", "[w Z' Y' b X t]"}) {
        const Machine both(Chain::parse(chain), ErrorMap(table), tool), plus(Chain::parse(chain), positive, tool);
        const Vector3d c(123.4, 567.8, 91.0);
        EXPECT_EQ(both.pose(c).position, plus.pose(c).position);
        EXPECT_EQ(both.pose(c).rotation, plus.pose(c).rotation);
        for (const Axis axis : stepdiag::all_axes) {
            stepdiag::ParameterTable one = positive.table();  // that axis has the other tables whichever the direction
            for (int i = 6 * index(axis); i < 6 * index(axis) + 6; ++i) one.functions[i] = table.negative_functions[i];
            const Machine expected(Chain::parse(chain), ErrorMap(one), tool);
            stepdiag::Approaches approach = stepdiag::all_positive;
            approach[index(axis)] = Approach::negative;
            EXPECT_EQ(both.pose(c, approach).position, expected.pose(c).position);
            EXPECT_EQ(both.pose(c, approach).rotation, expected.pose(c).rotation);
            EXPECT_EQ(both.error(c, approach), expected.error(c));
            EXPECT_EQ(both.first_order_error(c, approach), expected.first_order_error(c));
        }
    }
}
