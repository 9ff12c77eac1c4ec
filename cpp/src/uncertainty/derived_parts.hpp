// What the derived quantities share. Internal.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/derived.hpp"
#include "uncertainty/functional.hpp"

namespace stepdiag {

Eigen::Vector3d tool_of(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool);

// The deviations along a body diagonal as rows on the entries.
struct DiagonalRows {
    Line line;
    Eigen::Matrix<double, Eigen::Dynamic, 3> point;
    Eigen::VectorXd travel;
    Eigen::MatrixXd rows;
    std::vector<std::string> missing;
    std::vector<bool> is_missing = {};  // by point
};
std::vector<DiagonalRows> diagonal_rows(const Calibration& calibration, const Eigen::Vector3d& tool);

}  // namespace stepdiag
