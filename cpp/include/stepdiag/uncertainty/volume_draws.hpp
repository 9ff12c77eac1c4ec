// Draws of the largest error over a box and similar figures (volume_errors.hpp) from the joint normal distribution of a
// calibration's values. To first order in the errors, at the points of a grid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "stepdiag/uncertainty/volume_errors.hpp"

namespace stepdiag {

// Largest |e| and rms (mm), ranges of the components of e (mm), largest absolute tilts and their ranges (rad), ranges
// of the errors along the four body diagonals of the box (mm).
inline constexpr std::array<const char*, 15> volume_figures = {"largest", "rms",    "range X", "range Y", "range Z",
                                                               "tilt A",  "tilt B", "tilt C",  "range A", "range B",
                                                               "range C", "ppp",    "npp",     "pnp",     "nnp"};
// Columns after the figures, of the place and the direction of a draw's largest error: the calibration's error e there
// along that direction, and the length of e less what was drawn there (mm); the standard uncertainty of e along the
// direction, and of the covariance V of e the traces of V (mm^2) and V V.
inline constexpr int found_at_largest = int(volume_figures.size());
inline constexpr int opposite_at_largest = found_at_largest + 1;
inline constexpr int uncertainty_at_largest = found_at_largest + 2;
inline constexpr int variance_at_largest = found_at_largest + 3;
inline constexpr int variance2_at_largest = found_at_largest + 4;
inline constexpr int volume_columns = found_at_largest + 5;

class VolumeDraws {
public:
    // Throws InvalidArgument for a calibration without covariance, and for a grid that does not ascend or has fewer
    // than two positions an axis.
    VolumeDraws(const Calibration& calibration, const GridPositions& grid,
                const std::optional<Eigen::Vector3d>& tool = {}, std::uint64_t seed = 0);
    ~VolumeDraws();
    VolumeDraws(VolumeDraws&&) noexcept;

    // One row a draw: volume_figures, then the columns above. Draw number i has the same bits however the draws are
    // divided among calls and threads.
    using Figures = Eigen::Matrix<double, Eigen::Dynamic, volume_columns, Eigen::RowMajor>;
    Figures draw(std::uint64_t first, std::size_t count) const;
    // Of the calibration's own values, of which nothing is drawn.
    Eigen::RowVectorXd values() const;

private:
    struct State;
    std::unique_ptr<const State> state_;
};

}  // namespace stepdiag
