#include "stepdiag/plan/line.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Line;
using stepdiag::test::volume;

std::vector<std::string> all_names() {
    std::vector<std::string> names;
    for (const char x : {'p', 'n', '0'})
        for (const char y : {'p', 'n', '0'})
            for (const char z : {'p', 'n', '0'})
                if (std::string{x, y, z} != "000") names.push_back({x, y, z});
    return names;
}

Matrix3d frame(const char* name) { return stepdiag::line_frame(Line::parse(name), volume); }

Matrix3d columns(const Vector3d& x, const Vector3d& y, const Vector3d& z) {
    Matrix3d m;
    m << x, y, z;
    return m;
}

}  // namespace

TEST(Line, AllTwentySixNamesAreReadBack) {
    const auto names = all_names();
    ASSERT_EQ(names.size(), 26u);
    for (const auto& name : names) EXPECT_EQ(Line::parse(name).name(), name);
}

TEST(Line, FrameIsOrthonormalRightHandedAndLooksAlongTravel) {
    for (const auto& name : all_names())
        for (const Vector3d& edges :
             {volume, Vector3d(1.0, 1.0, 1.0), Vector3d(1e-2, 3000.0, 7.0), Vector3d(260.0, 420.0, 160.0)}) {
            const Line line = Line::parse(name);
            const Matrix3d f = stepdiag::line_frame(line, edges);
            // Square roots and quotients of order 1, each rounded once.
            EXPECT_LE((f.transpose() * f - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15) << name;
            EXPECT_NEAR(f.determinant(), 1.0, 1e-15) << name;
            Vector3d travel;
            for (const auto axis : stepdiag::all_axes) travel[index(axis)] = line.sign(axis) * edges[index(axis)];
            EXPECT_LE((f.col(2) - travel.normalized()).norm(), 1e-15) << name;
        }
}

TEST(Line, FrameOfPppIsEquationTwo) {
    const double X = 800, Y = 600, Z = 500, Dxy = 1000, D = std::sqrt(1.25e6);
    EXPECT_LE((frame("ppp") -
               columns({Y / Dxy, -X / Dxy, 0}, {X * Z / (Dxy * D), Y * Z / (Dxy * D), -Dxy / D}, {X / D, Y / D, Z / D}))
                  .cwiseAbs()
                  .maxCoeff(),
              2.3e-16);  // one rounding of numbers below 1, and one of D
}

TEST(Line, FramesOfTheOtherDiagonalsAreEquationTwoWithSigns) {  // D_npp(X, Y, Z) = D_ppp(-X, Y, Z) and so on
    const double X = 800, Y = 600, Z = 500, Dxy = 1000, D = std::sqrt(1.25e6);
    const struct {
        const char* name;
        double x, y, z;
    } cases[] = {{"npp", -X, Y, Z}, {"pnp", X, -Y, Z}, {"nnp", -X, -Y, Z}, {"ppn", X, Y, -Z}, {"nnn", -X, -Y, -Z}};
    for (const auto& c : cases)
        EXPECT_LE((frame(c.name) - columns({c.y / Dxy, -c.x / Dxy, 0},
                                           {c.x * c.z / (Dxy * D), c.y * c.z / (Dxy * D), -Dxy / D},
                                           {c.x / D, c.y / D, c.z / D}))
                      .cwiseAbs()
                      .maxCoeff(),
                  2.3e-16)
            << c.name;
}

TEST(Line, FramesOfSingleAxesAndFacesAreTheKnownOnes) {
    const Vector3d ex(1, 0, 0), ey(0, 1, 0), ez(0, 0, 1);
    EXPECT_EQ(frame("p00"), columns(-ey, -ez, ex));
    EXPECT_EQ(frame("n00"), columns(ey, -ez, -ex));
    EXPECT_EQ(frame("0p0"), columns(ex, -ez, ey));
    EXPECT_EQ(frame("0n0"), columns(-ex, -ez, -ey));
    EXPECT_EQ(frame("00p"), columns(-ey, ex, ez));  // the limit X -> 0+
    EXPECT_EQ(frame("00n"), columns(-ey, -ex, -ez));
    EXPECT_LE((frame("pp0") - columns({0.6, -0.8, 0}, -ez, {0.8, 0.6, 0})).cwiseAbs().maxCoeff(), 1.2e-16);
}

TEST(Line, SingleAxisZIsTheLimitOfXToZero) {
    for (const char* sign : {"p", "n"}) {
        const Matrix3d limit = stepdiag::line_frame(Line::parse(std::string("p0") + sign), {1e-12, 600.0, 500.0});
        EXPECT_LE((limit - frame((std::string("00") + sign).c_str())).cwiseAbs().maxCoeff(), 1e-14);  // X/Z = 2e-15
    }
}

TEST(Line, WhatIsNoLineIsRefusedByName) {
    for (const char* name : {"", "p", "pp", "pppp", "000", "PPP", "xyz", "p p", "pp1", "+++", "ppp ", "p\xC3\xA4"})
        expect_refused([&] { Line::parse(name); }, "line \"" + std::string(name) + "\"");
}
