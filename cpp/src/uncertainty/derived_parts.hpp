// Common parts of the derived quantities. Internal.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/derived.hpp"
#include "uncertainty/functional.hpp"

namespace stepdiag {

Eigen::Vector3d tool_of(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool);

// Errors along a body diagonal as linear functions of the calibration's entries.
struct DiagonalRows {
    Line line;
    Eigen::Matrix<double, Eigen::Dynamic, 3> point;
    Eigen::VectorXd travel;
    Eigen::MatrixXd rows;
    std::vector<std::string> missing;
    std::vector<bool> is_missing = {};  // for each point
};
std::vector<DiagonalRows> diagonal_rows(const Calibration& calibration, const Eigen::Vector3d& tool);

}  // namespace stepdiag
