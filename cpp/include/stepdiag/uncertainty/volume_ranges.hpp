// Ranges of the deviations of a machine over its volume (volumetric accuracy V_XYZ and similar quantities of ISO
// 230-1:2012, clause 3) and along its body diagonals (E_D of ISO 230-6).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/derived.hpp"

namespace stepdiag {

// Six ranges over the volume (largest minus smallest deviation; mm, rad), then the ranges of the errors along the four
// body diagonals (mm).
inline constexpr int range_count = deviation_count + 4;
using Ranges = Eigen::Matrix<double, range_count, 1>;
inline constexpr std::array<const char*, range_count> range_names = {"V_X", "V_Y",     "V_Z",     "V_A",     "V_B",
                                                                     "V_C", "E_D ppp", "E_D npp", "E_D pnp", "E_D nnp"};

// Computes the ranges for values at the nodes of a calibration. Between nodes, deviations are linear in each position,
// and their extremes are at nodes. Exception: along an axis that carries the workpiece, deviations are quadratic
// between nodes with different rotations. Such an axis is divided more finely.
class VolumeRanges {
public:
    VolumeRanges(const Calibration& calibration, const Eigen::Vector3d& tool);
    ~VolumeRanges();
    VolumeRanges(VolumeRanges&&) noexcept;

    // `tool`: offset of the functional point, mm; `values`: in the order of the calibration's entries. A range is NaN
    // if a parameter is missing.
    Ranges evaluate(const Eigen::VectorXd& values) const;
    // Upper bound for the excess of deviations between grid points over those at grid points, for these values, mm.
    double resolution(const Eigen::VectorXd& values) const;
    const std::array<std::vector<std::string>, range_count>& missing() const;

private:
    struct State;
    std::unique_ptr<const State> state_;
};

}  // namespace stepdiag
