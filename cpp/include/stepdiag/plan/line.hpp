// A measurement line. Its name gives the direction of travel of X, Y and Z: p (positive), n (negative) or 0 (not
// moved). All 26 combinations that move an axis are valid: body diagonals, face diagonals and single-axis lines.
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
    // Throws InvalidArgument unless the name has three letters p, n or 0 and moves at least one axis.
    static Line parse(std::string_view name);

    std::string name() const;
    int sign(Axis axis) const { return sign_[index(axis)]; }  // +1, -1, or 0 if the axis does not move
    bool moves(Axis axis) const { return sign(axis) != 0; }
    int moved_axes() const;
    bool is_body_diagonal() const { return moved_axes() == 3; }

    bool operator==(const Line& other) const { return sign_ == other.sign_; }

private:
    explicit Line(std::array<int, 3> sign) : sign_(sign) {}
    std::array<int, 3> sign_;
};

// machine_R_line: the line's local frame in machine coordinates. Its columns are local x, y, z (eq. 2 of the paper).
// `volume`: edges X, Y, Z, mm. With (X,Y,Z) = sign * edge (0 for an axis that does not move), Dxy = sqrt(X^2+Y^2) and
// Dxyz = sqrt(X^2+Y^2+Z^2):
//   x = (Y,-X,0)/Dxy   y = (XZ, YZ, -Dxy^2)/(Dxy Dxyz)   z = (X,Y,Z)/Dxyz, the travel direction
// For X = Y = 0 the limit X -> 0+ applies: x = (0,-1,0), y = (sign Z,0,0), z = (0,0,sign Z).
Eigen::Matrix3d line_frame(const Line& line, const Eigen::Vector3d& volume);

}  // namespace stepdiag
