// A measurement line, named by the travel sign of X, Y, Z: p, n or 0 (not moved). All 26 names are valid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/core/axis.hpp"

namespace stepdiag {

class Line {
public:
    // Throws InvalidArgument for anything but three of p n 0 that move an axis.
    static Line parse(std::string_view name);

    std::string name() const;
    int sign(Axis axis) const { return sign_[index(axis)]; }
    bool moves(Axis axis) const { return sign(axis) != 0; }
    int moved_axes() const;
    bool is_body_diagonal() const { return moved_axes() == 3; }

    bool operator==(const Line& other) const { return sign_ == other.sign_; }

private:
    explicit Line(std::array<int, 3> sign) : sign_(sign) {}
    std::array<int, 3> sign_;
};

// machine_R_line, the line's local frame in machine coordinates; columns are local x, y, z (eq. 2 of the paper). With
// (X,Y,Z) = sign * edge, 0 where not moved, Dxy = sqrt(X^2+Y^2), Dxyz = sqrt(X^2+Y^2+Z^2):
//   x = (Y,-X,0)/Dxy   y = (XZ, YZ, -Dxy^2)/(Dxy Dxyz)   z = (X,Y,Z)/Dxyz, the travel direction
// and where X = Y = 0 the limit X -> 0+: x = (0,-1,0), y = (sign Z,0,0), z = (0,0,sign Z).
Eigen::Matrix3d line_frame(const Line& line, const Eigen::Vector3d& volume);

}  // namespace stepdiag
