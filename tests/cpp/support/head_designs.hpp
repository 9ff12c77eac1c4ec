// Two small heads for tests: three interferometers behind a window, and one interferometer next to a laser with
// splitter and PSD.
#pragma once

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/head/design.hpp"

namespace stepdiag::test {

inline HeadBody window(double thickness = 5.0) {
    return {"window",
            make_plate(60.0, 60.0, thickness, {}),
            find_glass("N-BK7"),
            {{0.0, 0.0, 12.0}, Eigen::Matrix3d::Identity()}};
}

inline HeadBeam interferometer(const std::string& name, double u, double v) {
    HeadBeam beam{name, {{u, v, 0.0}, Eigen::Matrix3d::Identity()}, {1530.0, 0.8, 0.0}, Interferometer{}, ""};
    return beam;
}

inline HeadDesign three_beams() {
    return {"three beams",
            HeadLayout::multi_beam,
            {window()},
            {interferometer("d1", 0, 0), interferometer("d2", 20, 0), interferometer("d3", 0, 20)},
            {},
            {}};
}

inline HeadDesign beam_and_psd() {
    HeadBeam laser{"laser", {{20.0, 0.0, -60.0}, Eigen::Matrix3d::Identity()}, {635.0, 0.5, 0.0}, {}, "psd"};
    return {"beam and psd",
            HeadLayout::psd,
            {window(),
             {"splitter",
              make_cube_splitter(20.0, {}),
              find_glass("N-BK7"),
              {{20.0, 0.0, -30.0}, Eigen::Matrix3d::Identity()}}},
            {interferometer("distance", 0, 0), laser},
            {{"psd", {{0.0, 0.0, -30.0}, rotation_exp({0.0, 0.5 * pi, 0.0})}, LateralEffect{}}},
            {}};
}

}  // namespace stepdiag::test
