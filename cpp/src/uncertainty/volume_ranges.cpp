// Ranges over a volume. To first order, a deviation is a sum of functions of one position and products of two
// positions. With axes 1, 2, 3 from workpiece to tool:
//   e = F1(p1) + F2(p2) + F3(p3) + G12(p1) p2 + G13(p1) p3 + G23(p2) p3
// For given p1 and p2, the extreme over p3 is the extreme of F3 + slope p3, which is at a corner of the convex hull of
// F3. F is quadratic between nodes along an axis that carries the workpiece. For axis 1 the search is exact, in those
// cells that can contain the extreme. For axes 2 and 3 it uses a finer grid if they carry the workpiece, too.
#include "stepdiag/uncertainty/volume_ranges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "uncertainty/derived_parts.hpp"
#include "uncertainty/upper_hull.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int finer = 16;  // divisions of an interval for a search on a grid

// Position, translation and rotation of one axis at its grid points.
struct AxisTable {
    std::vector<double> position;
    Matrix3Xd delta;
    Matrix3Xd theta;
};
struct AxisState {
    double position;
    Vector3d delta;
    Vector3d theta;
};

AxisState between(const AxisTable& table, Index interval, double t) {
    const auto mix = [&](const auto& a, const auto& b) -> Vector3d { return a + t * (b - a); };
    return {table.position[std::size_t(interval)] +
                t * (table.position[std::size_t(interval) + 1] - table.position[std::size_t(interval)]),
            mix(table.delta.col(interval), table.delta.col(interval + 1)),
            mix(table.theta.col(interval), table.theta.col(interval + 1))};
}

// Largest value of a parabola between its end points. In the middle it is higher than the chord by `sag`.
double top_of_arc(double begin, double end, double sag) {
    const double slope = (end - begin) / (4.0 * sag);
    if (!(sag > 0.0 && std::abs(slope) < 1.0)) return std::max(begin, end);
    return (begin + end) / 2.0 + sag * (1.0 + slope * slope);
}

}  // namespace

struct VolumeRanges::Grid {
    Chain chain;
    Vector3d tool;
    EntryLayout layout;
    std::array<std::vector<double>, 3> position;  // of each axis
    // [6 axis + component][grid point]: weighted entries whose sum is the value; empty for an absent function
    std::array<std::vector<std::array<EntryLayout::Weighted, 2>>, function_count> nodes;
    std::array<std::vector<std::string>, range_count> missing;
    std::vector<DiagonalRows> diagonals;

    AxisTable table(Axis axis, const VectorXd& values) const;
    // Deviations X, Y, Z minus their chord in the middle of an interval of an axis; 0 for linear deviations.
    Vector3d sag(const AxisTable& table, Axis axis, Index interval) const;
    Vector3d deviation(const std::array<AxisState, 3>& states) const;  // states in the order of the chain
    struct Terms;
    Terms terms(const std::array<AxisTable, 3>& tables, int component, double sign) const;
    double largest(const std::array<AxisTable, 3>& tables, int component, double sign) const;
    double search_cells(const std::array<AxisTable, 3>& tables, int component, double sign, const Terms& at,
                        const Eigen::MatrixXd& top) const;
};

AxisTable VolumeRanges::Grid::table(Axis axis, const VectorXd& values) const {
    const auto& positions = position[std::size_t(index(axis))];
    AxisTable table{positions, Matrix3Xd::Zero(3, Index(positions.size())),
                    Matrix3Xd::Zero(3, Index(positions.size()))};
    for (int c = 0; c < 6; ++c) {
        const auto& of_function = nodes[std::size_t(FunctionId{axis, Component(c)}.index())];
        for (std::size_t k = 0; k < of_function.size(); ++k) {
            double value = 0.0;
            for (const auto& node : of_function[k]) value += node.weight * values[node.entry];
            (c < 3 ? table.delta : table.theta)(c % 3, Index(k)) = value;
        }
    }
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        const int parameter = function_count + static_cast<int>(s);
        if (term.axis != axis || !layout.has(parameter)) continue;
        for (std::size_t k = 0; k < positions.size(); ++k)
            table.delta(term.component, Index(k)) += term.sign * positions[k] * values[layout.first(parameter)];
    }
    return table;
}

Vector3d VolumeRanges::Grid::sag(const AxisTable& table, Axis axis, Index interval) const {
    if (!chain.carries_workpiece(axis)) return Vector3d::Zero();
    const double length = table.position[std::size_t(interval) + 1] - table.position[std::size_t(interval)];
    // theta x p e_a with theta = theta_0 + (turn/length) (p - p_0) has the second derivative 2 turn/length x e_a.
    const Vector3d turn = table.theta.col(interval + 1) - table.theta.col(interval);
    return -turn.cross(Vector3d::Unit(index(axis))) * length / 4.0;
}

Vector3d VolumeRanges::Grid::deviation(const std::array<AxisState, 3>& states) const {
    Vector3d commanded;
    for (int r = 0; r < 3; ++r) commanded[index(chain.order()[std::size_t(r)])] = states[std::size_t(r)].position;
    Vector3d error = Vector3d::Zero();
    for (int r = 0; r < 3; ++r) {
        const AxisState& state = states[std::size_t(r)];
        error += state.delta + state.theta.cross(angular_lever(chain, tool, chain.order()[std::size_t(r)], commanded));
    }
    return error;
}

// Terms of one deviation, multiplied by sign, at the grid points of the three axes in the order of the chain.
struct VolumeRanges::Grid::Terms {
    std::array<VectorXd, 3> own;  // F1, F2, F3
    VectorXd g12, g13, g23;
    std::array<VectorXd, 3> sag;  // of each interval
};

VolumeRanges::Grid::Terms VolumeRanges::Grid::terms(const std::array<AxisTable, 3>& tables, int component,
                                                    double sign) const {
    const auto& order = chain.order();
    Terms terms;
    for (std::size_t r = 0; r < 3; ++r) {
        const AxisTable& table = tables[r];
        terms.own[r].resize(Index(table.position.size()));
        for (Index k = 0; k < terms.own[r].size(); ++k) {
            Vector3d lever = tool;
            if (chain.carries_workpiece(order[r])) lever[index(order[r])] += table.position[std::size_t(k)];
            terms.own[r][k] = sign * (table.delta.col(k) + Vector3d(table.theta.col(k)).cross(lever))[component];
        }
        terms.sag[r].resize(terms.own[r].size() - 1);
        for (Index k = 0; k < terms.sag[r].size(); ++k) terms.sag[r][k] = sign * sag(table, order[r], k)[component];
    }
    const auto slopes = [&](std::size_t r, std::size_t after) {
        const Vector3d axis = Vector3d::Unit(index(order[after]));
        VectorXd g(terms.own[r].size());
        for (Index k = 0; k < g.size(); ++k) g[k] = sign * Vector3d(tables[r].theta.col(k)).cross(axis)[component];
        return g;
    };
    terms.g12 = slopes(0, 1);
    terms.g13 = slopes(0, 2);
    terms.g23 = slopes(1, 2);
    return terms;
}

// Largest value of sign times deviation.
double VolumeRanges::Grid::largest(const std::array<AxisTable, 3>& tables, int component, double sign) const {
    const Terms at = terms(tables, component, sign);
    const auto& p2 = tables[1].position;
    const auto& p3 = tables[2].position;
    const UpperHull hull(p3, at.own[2]);
    std::size_t corner = 0;
    Eigen::MatrixXd top(at.own[0].size(), at.own[1].size());
    for (Index j = 0; j < top.cols(); ++j)
        for (Index i = 0; i < top.rows(); ++i)
            top(i, j) = at.own[0][i] + at.own[1][j] + at.g12[i] * p2[std::size_t(j)] +
                        hull.support(at.g13[i] + at.g23[j], corner);
    double best = top.maxCoeff();
    const auto& order = chain.order();
    if (chain.carries_workpiece(order[1])) return search_cells(tables, component, sign, at, top);
    if (!chain.carries_workpiece(order[0])) return best;
    for (Index i = 0; i < at.sag[0].size(); ++i)
        for (Index j = 0; j < top.cols(); ++j) {
            if (!(std::max(top(i, j), top(i + 1, j)) + at.sag[0][i] > best)) continue;
            for (std::size_t k = 0; k < p3.size(); ++k) {
                const auto end = [&](Index n) {
                    return at.own[0][n] + at.own[1][j] + at.own[2][Index(k)] + at.g12[n] * p2[std::size_t(j)] +
                           (at.g13[n] + at.g23[j]) * p3[k];
                };
                best = std::max(best, top_of_arc(end(i), end(i + 1), at.sag[0][i]));
            }
        }
    return best;
}

// The same if the second axis is also quadratic between nodes.
double VolumeRanges::Grid::search_cells(const std::array<AxisTable, 3>& tables, int component, double sign,
                                        const Terms& at, const Eigen::MatrixXd& top) const {
    const int parts = chain.carries_workpiece(chain.order()[2]) ? finer : 1;
    const double sag3 = std::max(at.sag[2].maxCoeff(), 0.0);
    double best = top.maxCoeff();
    const auto value = [&](Index i, const AxisState& two, const AxisState& three) {
        const AxisState one{tables[0].position[std::size_t(i)], tables[0].delta.col(i), tables[0].theta.col(i)};
        return sign * deviation({one, two, three})[component];
    };
    const auto highest_corner = [&](Index i, Index j, Index k) {
        double highest = -std::numeric_limits<double>::infinity();
        for (const Index a : {i, i + 1})
            for (const Index b : {j, j + 1})
                for (const Index c : {k, k + 1})
                    highest = std::max(highest, at.own[0][a] + at.own[1][b] + at.own[2][c] +
                                                    at.g12[a] * tables[1].position[std::size_t(b)] +
                                                    (at.g13[a] + at.g23[b]) * tables[2].position[std::size_t(c)]);
        return highest;
    };
    for (Index i = 0; i < at.sag[0].size(); ++i)
        for (Index j = 0; j < at.sag[1].size(); ++j) {
            const double higher = std::max(at.sag[0][i], 0.0) + std::max(at.sag[1][j], 0.0) + sag3;
            if (!(top.block<2, 2>(i, j).maxCoeff() + higher > best)) continue;
            for (Index k = 0; k < at.sag[2].size(); ++k) {
                if (!(highest_corner(i, j, k) + higher > best)) continue;
                for (int b = 0; b <= finer; ++b) {
                    const AxisState two = between(tables[1], j, double(b) / finer);
                    for (int c = 0; c <= parts; ++c) {
                        const AxisState three = between(tables[2], k, double(c) / parts);
                        best = std::max(best, top_of_arc(value(i, two, three), value(i + 1, two, three), at.sag[0][i]));
                    }
                }
            }
        }
    return best;
}

VolumeRanges::VolumeRanges(const Calibration& calibration, const Vector3d& tool) : grid_(nullptr) {
    auto grid = std::make_unique<Grid>(
        Grid{calibration.chain, tool, EntryLayout(calibration), {}, {}, {}, diagonal_rows(calibration, tool)});
    for (const Axis axis : all_axes) {
        const double travel = calibration.volume[index(axis)];
        auto& positions = grid->position[std::size_t(index(axis))];
        std::vector<double> all = {0.0, travel};
        for (int c = 0; c < 6; ++c)
            if (const auto& f = calibration.functions[std::size_t(FunctionId{axis, Component(c)}.index())])
                for (const double p : f->position)
                    if (p > 0.0 && p < travel) all.push_back(p);
        std::sort(all.begin(), all.end());
        // The positions of a node may differ in the last digits between functions.
        for (const double p : all)
            if (positions.empty() || p - positions.back() > 1e-9 * travel) positions.push_back(p);
        for (int c = 0; c < 6; ++c) {
            const int function = FunctionId{axis, Component(c)}.index();
            if (!grid->layout.has(function)) continue;
            for (const double p : positions)
                grid->nodes[std::size_t(function)].push_back(grid->layout.interpolation(function, p));
        }
    }
    // Missing parameters at a point where no lever is 0.
    const Vector3d somewhere = calibration.volume.cwiseProduct(Vector3d(0.37, 0.61, 0.83));
    const auto deviations = deviations_at(calibration.chain, tool, somewhere);
    for (std::size_t c = 0; c < deviation_count; ++c) grid->missing[c] = grid->layout.missing(deviations[c]);
    for (std::size_t d = 0; d < 4; ++d) grid->missing[deviation_count + d] = grid->diagonals[d].missing;
    grid_ = std::move(grid);
}

VolumeRanges::~VolumeRanges() = default;
VolumeRanges::VolumeRanges(VolumeRanges&&) noexcept = default;

Ranges VolumeRanges::evaluate(const VectorXd& values) const {
    std::array<AxisTable, 3> tables;
    for (std::size_t r = 0; r < 3; ++r) tables[r] = grid_->table(grid_->chain.order()[r], values);
    Ranges ranges;
    for (int c = 0; c < 3; ++c) {
        ranges[c] = grid_->missing[std::size_t(c)].empty()
                        ? grid_->largest(tables, c, 1.0) + grid_->largest(tables, c, -1.0)
                        : 0.0;
        ranges[c + 3] = 0.0;  // rotations are sums of functions of one position
        for (const AxisTable& table : tables)
            ranges[c + 3] += table.theta.row(c).maxCoeff() - table.theta.row(c).minCoeff();
    }
    for (int d = 0; d < 4; ++d) {
        const VectorXd along = grid_->diagonals[std::size_t(d)].rows * values;
        ranges[deviation_count + d] = along.maxCoeff() - along.minCoeff();
    }
    for (int i = 0; i < range_count; ++i)
        if (!grid_->missing[std::size_t(i)].empty()) ranges[i] = std::numeric_limits<double>::quiet_NaN();
    return ranges;
}

double VolumeRanges::resolution(const VectorXd& values) const {
    Vector3d sum = Vector3d::Zero();
    for (const Axis axis : {grid_->chain.order()[1], grid_->chain.order()[2]}) {
        const AxisTable table = grid_->table(axis, values);
        Vector3d largest = Vector3d::Zero();
        for (Index k = 0; k + 1 < Index(table.position.size()); ++k)
            largest = largest.cwiseMax(grid_->sag(table, axis, k).cwiseAbs());
        sum += largest;
    }
    return sum.maxCoeff() / (finer * finer);
}

const std::array<std::vector<std::string>, range_count>& VolumeRanges::missing() const { return grid_->missing; }

}  // namespace stepdiag
