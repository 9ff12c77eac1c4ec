// A body of many faces for tests.
#pragma once

#include <cmath>
#include <vector>

#include "stepdiag/core/units.hpp"
#include "stepdiag/optics/body.hpp"

// A polyhedron with its corners on a sphere: `rings` bands of `sectors` faces each.
inline std::vector<stepdiag::Face> make_sphere(double radius, int rings, int sectors,
                                               const stepdiag::Placement& placement = {}) {
    std::vector<Eigen::Vector3d> corners{{0.0, 0.0, radius}};
    for (int r = 1; r < rings; ++r)
        for (int s = 0; s < sectors; ++s) {
            const double polar = stepdiag::pi * r / rings, azimuth = 2.0 * stepdiag::pi * s / sectors;
            corners.emplace_back(radius * std::sin(polar) * std::cos(azimuth),
                                 radius * std::sin(polar) * std::sin(azimuth), radius * std::cos(polar));
        }
    corners.emplace_back(0.0, 0.0, -radius);
    const auto corner = [&](int r, int s) {
        if (r == 0) return 0;
        return r == rings ? int(corners.size()) - 1 : 1 + (r - 1) * sectors + s % sectors;
    };
    std::vector<std::vector<int>> faces;
    for (int s = 0; s < sectors; ++s) {
        faces.push_back({corner(0, s), corner(1, s), corner(1, s + 1)});
        for (int r = 1; r < rings - 1; ++r)
            faces.push_back({corner(r, s), corner(r + 1, s), corner(r + 1, s + 1), corner(r, s + 1)});
        faces.push_back({corner(rings - 1, s), corner(rings, s), corner(rings - 1, s + 1)});
    }
    return stepdiag::make_body(corners, faces, {1.5}, placement);
}
