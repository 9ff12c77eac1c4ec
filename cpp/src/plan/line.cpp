#include "stepdiag/plan/line.hpp"

#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

Line Line::parse(std::string_view name) {
    std::array<int, 3> sign{};
    bool valid = name.size() == 3 && name != "000";
    for (std::size_t i = 0; valid && i < 3; ++i) {
        valid = name[i] == 'p' || name[i] == 'n' || name[i] == '0';
        sign[i] = name[i] == 'p' ? 1 : name[i] == 'n' ? -1 : 0;
    }
    if (!valid)
        throw InvalidArgument("line \"" + std::string(name) +
                              "\": expected three of p, n, 0 (travel signs of X, Y, Z) with at least one axis moved, "
                              "such as \"ppp\" or \"p0n\"");
    return Line(sign);
}

std::string Line::name() const {
    std::string text;
    for (const int s : sign_) text += s > 0 ? 'p' : s < 0 ? 'n' : '0';
    return text;
}

int Line::moved_axes() const { return std::abs(sign_[0]) + std::abs(sign_[1]) + std::abs(sign_[2]); }

Eigen::Matrix3d line_frame(const Line& line, const Eigen::Vector3d& volume) {
    const double X = line.sign(Axis::X) * volume.x();
    const double Y = line.sign(Axis::Y) * volume.y();
    const double Z = line.sign(Axis::Z) * volume.z();
    Eigen::Matrix3d frame;
    if (X == 0.0 && Y == 0.0) {
        const double s = Z > 0.0 ? 1.0 : -1.0;
        frame.col(0) << 0.0, -1.0, 0.0;
        frame.col(1) << s, 0.0, 0.0;
        frame.col(2) << 0.0, 0.0, s;
    } else {
        const double Dxy = std::sqrt(X * X + Y * Y);
        const double Dxyz = std::sqrt(X * X + Y * Y + Z * Z);
        frame.col(0) << Y / Dxy, -X / Dxy, 0.0;
        frame.col(1) << X * Z / (Dxy * Dxyz), Y * Z / (Dxy * Dxyz), -Dxy / Dxyz;
        frame.col(2) << X / Dxyz, Y / Dxyz, Z / Dxyz;
    }
    return frame;
}

}  // namespace stepdiag
