// Errors of the functional point at the points of a grid, to first order. With axes 1, 2, 3 from workpiece to tool:
//   e = F1(p1) + F2(p2) + F3(p3) + G12(p1) p2 + (G13(p1) + G23(p2)) p3
// Internal.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "stepdiag/uncertainty/volume_errors.hpp"
#include "uncertainty/functional.hpp"

namespace stepdiag {

// F and G at the grid points, by component; F by axis in the order of the chain.
struct VolumeField {
    using Component3 = std::array<Eigen::ArrayXd, 3>;

    std::array<Component3, 3> own;
    Component3 g12, g13, g23;
};

using GridPlace = std::array<Eigen::Index, 3>;  // positions by rank

// The points of a grid, and what the values of a calibration are there. A table has, for each axis in the order of the
// chain, EX of all its positions, then EY, EZ, EA, EB, EC, with the squareness terms. Parameters that are missing are
// 0.
class VolumeGrid {
public:
    VolumeGrid(const Calibration& calibration, const GridPositions& grid, const Eigen::Vector3d& tool);

    const Eigen::ArrayXd& position(std::size_t rank) const { return position_[rank]; }  // of an axis by its rank
    Axis axis(std::size_t rank) const { return order_[rank]; }
    bool carries_workpiece(std::size_t rank) const { return carries_workpiece_[rank]; }

    Eigen::VectorXd table(const Eigen::VectorXd& values) const;
    Eigen::MatrixXd covariance(const Eigen::MatrixXd& of_values) const;  // of a table
    void field(const double* table, VolumeField& field) const;
    Eigen::Vector3d error(const VolumeField& field, const GridPlace& place) const;
    // Covariance of the error at a place, from that of a table.
    Eigen::Matrix3d error_covariance(const Eigen::MatrixXd& covariance, const GridPlace& place) const;
    // Positions by components of one axis, in a table.
    Eigen::Map<const Eigen::MatrixXd> functions(const double* table, std::size_t rank) const;

private:
    std::array<Axis, 3> order_;
    std::array<bool, 3> carries_workpiece_;
    Eigen::Vector3d tool_;
    std::array<Eigen::ArrayXd, 3> position_;
    std::vector<std::vector<EntryLayout::Weighted>> rows_;  // of a table, by the calibration's values
};

}  // namespace stepdiag
