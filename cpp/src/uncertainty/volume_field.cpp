#include "uncertainty/volume_field.hpp"

#include <Eigen/Geometry>

namespace stepdiag {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VolumeGrid::VolumeGrid(const Calibration& calibration, const GridPositions& grid, const Eigen::Vector3d& tool)
    : tool_(tool) {
    const EntryLayout layout(calibration);
    for (std::size_t r = 0; r < 3; ++r) {
        const Axis axis = order_[r] = calibration.chain.order()[r];
        carries_workpiece_[r] = calibration.chain.carries_workpiece(axis);
        const auto& positions = grid[std::size_t(index(axis))];
        position_[r] = Eigen::Map<const ArrayXd>(positions.data(), Index(positions.size()));
        for (int c = 0; c < 6; ++c)
            for (const double p : positions) {
                auto& row = rows_.emplace_back();
                const int function = FunctionId{axis, Component(c)}.index();
                if (layout.has(function))
                    for (const auto& node : layout.interpolation(function, p))
                        if (node.weight != 0.0) row.push_back(node);
                for (const Squareness q : all_squarenesses) {
                    const SquarenessTerm term = squareness_term(q);
                    const int parameter = function_count + static_cast<int>(q);
                    if (term.axis == axis && term.component == c && layout.has(parameter))
                        row.push_back({layout.first(parameter), term.sign * p});
                }
            }
    }
}

VectorXd VolumeGrid::table(const VectorXd& values) const {
    VectorXd table = VectorXd::Zero(Index(rows_.size()));
    for (Index i = 0; i < table.size(); ++i)
        for (const auto& [entry, weight] : rows_[std::size_t(i)]) table[i] += weight * values[entry];
    return table;
}

MatrixXd VolumeGrid::covariance(const MatrixXd& of_values) const {
    const Index n = Index(rows_.size());
    MatrixXd half = MatrixXd::Zero(of_values.rows(), n);
    for (Index i = 0; i < n; ++i)
        for (const auto& [entry, weight] : rows_[std::size_t(i)]) half.col(i) += weight * of_values.col(entry);
    MatrixXd covariance = MatrixXd::Zero(n, n);
    const MatrixXd half_rows = half.transpose();
    for (Index i = 0; i < n; ++i)
        for (const auto& [entry, weight] : rows_[std::size_t(i)]) covariance.col(i) += weight * half_rows.col(entry);
    return covariance;
}

Eigen::Map<const MatrixXd> VolumeGrid::functions(const double* table, std::size_t rank) const {
    for (std::size_t before = 0; before < rank; ++before) table += 6 * position_[before].size();
    return {table, position_[rank].size(), 6};
}

void VolumeGrid::field(const double* table, VolumeField& f) const {
    const auto slopes = [&](const Eigen::Map<const MatrixXd>& at, std::size_t after, VolumeField::Component3& g) {
        const int k = index(order_[after]), i = (k + 1) % 3, j = (k + 2) % 3;
        g[std::size_t(k)] = ArrayXd::Zero(at.rows());
        g[std::size_t(i)] = at.col(3 + j);  // theta x e_k = (.., theta_j, -theta_i), cyclically
        g[std::size_t(j)] = -at.col(3 + i).array();
    };
    for (std::size_t r = 0; r < 3; ++r) {
        const auto at = functions(table, r);
        for (int c = 0; c < 3; ++c) {
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            const auto turned_a = at.col(3 + a).array(), turned_b = at.col(3 + b).array();
            ArrayXd& own = f.own[r][std::size_t(c)];
            own = at.col(c).array() + turned_a * tool_[b] - turned_b * tool_[a];
            if (!carries_workpiece_[r]) continue;
            if (index(order_[r]) == b) own += turned_a * position_[r];
            if (index(order_[r]) == a) own -= turned_b * position_[r];
        }
        if (r == 0) {
            slopes(at, 1, f.g12);
            slopes(at, 2, f.g13);
        }
        if (r == 1) slopes(at, 2, f.g23);
    }
}

Eigen::Vector3d VolumeGrid::error(const VolumeField& f, const GridPlace& place) const {
    const auto [i, j, k] = place;
    const double p2 = position_[1][j], p3 = position_[2][k];
    Eigen::Vector3d e;
    for (std::size_t c = 0; c < 3; ++c)
        e[Index(c)] =
            f.own[0][c][i] + f.own[1][c][j] + f.own[2][c][k] + f.g12[c][i] * p2 + (f.g13[c][i] + f.g23[c][j]) * p3;
    return e;
}

Eigen::Matrix3d VolumeGrid::error_covariance(const MatrixXd& covariance, const GridPlace& place) const {
    std::array<Index, 18> entry;
    Eigen::Matrix<double, 3, 18> effect = Eigen::Matrix<double, 3, 18>::Zero();
    Eigen::Vector3d lever = tool_;  // of the rotations of an axis: from it to the functional point
    Index first = Index(rows_.size());
    for (std::size_t r = 3; r-- > 0;) {
        Eigen::Vector3d own = Eigen::Vector3d::Zero();
        own[index(order_[r])] = position_[r][place[r]];
        const Eigen::Vector3d of_rotations = carries_workpiece_[r] ? Eigen::Vector3d(lever + own) : lever;
        lever += own;
        const Index n = position_[r].size();
        first -= 6 * n;
        for (Index c = 0; c < 3; ++c) {
            const Index column = Index(6 * r) + c;
            effect(c, column) = 1.0;
            effect.col(column + 3) = Eigen::Vector3d::Unit(c).cross(of_rotations);
            entry[std::size_t(column)] = first + c * n + place[r];
            entry[std::size_t(column + 3)] = first + (c + 3) * n + place[r];
        }
    }
    return effect * covariance(entry, entry) * effect.transpose();
}

}  // namespace stepdiag
