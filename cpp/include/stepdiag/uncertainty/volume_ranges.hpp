// How far the deviations of a machine range over its volume, V_XYZ and its like (ISO 230-1:2012, clause 3), and along
// its body diagonals, E_D (ISO 230-6).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/derived.hpp"

namespace stepdiag {

// Six ranges over the volume, of deviations relative to each other, and the ranges of the four diagonals' errors.
inline constexpr int range_count = deviation_count + 4;
using Ranges = Eigen::Matrix<double, range_count, 1>;
inline constexpr std::array<const char*, range_count> range_names = {"V_X", "V_Y",     "V_Z",     "V_A",     "V_B",
                                                                     "V_C", "E_D ppp", "E_D npp", "E_D pnp", "E_D nnp"};

// The ranges of tables with the nodes of a calibration. Between nodes deviations are linear in each position, so that
// their extremes are at nodes; but along an axis that carries the workpiece they are quadratic where a rotation
// changes, and that axis is divided more finely.
class VolumeRanges {
public:
    VolumeRanges(const Calibration& calibration, const Eigen::Vector3d& tool);
    ~VolumeRanges();
    VolumeRanges(VolumeRanges&&) noexcept;

    Ranges evaluate(const Eigen::VectorXd& values) const;  // NaN where something is missing
    // By how much the deviations between the grid's points may exceed those on it, mm, at these values.
    double resolution(const Eigen::VectorXd& values) const;
    const std::array<std::vector<std::string>, range_count>& missing() const;

private:
    struct Grid;
    std::unique_ptr<const Grid> grid_;
};

}  // namespace stepdiag
