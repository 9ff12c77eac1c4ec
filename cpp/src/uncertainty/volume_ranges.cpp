// Ranges over a volume, from the field of volume_field.hpp. For given p1 and p2, the extreme over p3 is the extreme of
// F3 + slope p3, which is at a corner of the convex hull of F3. F is quadratic between nodes along an axis that carries
// the workpiece. For axis 1 the search is exact, in those cells that can contain the extreme. For axes 2 and 3 it uses
// a finer grid if they carry the workpiece, too.
#include "stepdiag/uncertainty/volume_ranges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "uncertainty/derived_parts.hpp"
#include "uncertainty/upper_hull.hpp"
#include "uncertainty/volume_field.hpp"

namespace stepdiag {
namespace {

using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int finer = 16;  // divisions of an interval for a search on a grid

// Largest value of a parabola between its end points. In the middle it is higher than the chord by `sag`.
double top_of_arc(double begin, double end, double sag) {
    const double slope = (end - begin) / (4.0 * sag);
    if (!(sag > 0.0 && std::abs(slope) < 1.0)) return std::max(begin, end);
    return (begin + end) / 2.0 + sag * (1.0 + slope * slope);
}

// Positions of a calibration's nodes and the ends of travel.
GridPositions node_positions(const Calibration& calibration) {
    GridPositions grid;
    for (const Axis axis : all_axes) {
        const double travel = calibration.volume[index(axis)];
        std::vector<double> all = {0.0, travel};
        for (int c = 0; c < 6; ++c)
            if (const auto& f = calibration.functions[std::size_t(FunctionId{axis, Component(c)}.index())])
                for (const double p : f->position)
                    if (p > 0.0 && p < travel) all.push_back(p);
        std::sort(all.begin(), all.end());
        // The positions of a node may differ in the last digits between functions.
        auto& positions = grid[std::size_t(index(axis))];
        for (const double p : all)
            if (positions.empty() || p - positions.back() > 1e-9 * travel) positions.push_back(p);
    }
    return grid;
}

// One component of e, multiplied by sign, with what F is above its chord in the middle of each interval.
struct Terms {
    std::array<ArrayXd, 3> own, sag;
    ArrayXd g12, g13, g23;
};

}  // namespace

struct VolumeRanges::State {
    VolumeGrid grid;
    std::array<std::vector<std::string>, range_count> missing;
    std::vector<DiagonalRows> diagonals;

    // Components of F minus its chord in the middle of the intervals of an axis; 0 for a linear F.
    MatrixXd sag(const double* table, std::size_t rank) const;
    double largest(const Terms& at) const;
    double search_cells(const Terms& at, const ArrayXXd& top) const;
};

MatrixXd VolumeRanges::State::sag(const double* table, std::size_t rank) const {
    const ArrayXd& position = grid.position(rank);
    const Index n = position.size() - 1;
    MatrixXd sag = MatrixXd::Zero(n, 3);
    if (!grid.carries_workpiece(rank)) return sag;
    const auto at = grid.functions(table, rank);
    // theta x p e_a with theta = theta_0 + (turn/length) (p - p_0) has the second derivative 2 turn/length x e_a.
    const ArrayXd length = position.tail(n) - position.head(n);
    for (Index k = 0; k < n; ++k) {
        const Vector3d turn = (at.row(k + 1) - at.row(k)).tail<3>();
        sag.row(k) = -turn.cross(Vector3d::Unit(index(grid.axis(rank)))) * length[k] / 4.0;
    }
    return sag;
}

double VolumeRanges::State::largest(const Terms& at) const {
    const ArrayXd &p2 = grid.position(1), &p3 = grid.position(2);
    const UpperHull hull(p3, at.own[2]);
    std::size_t corner = 0;
    ArrayXXd top(at.own[0].size(), p2.size());
    for (Index j = 0; j < top.cols(); ++j)
        for (Index i = 0; i < top.rows(); ++i)
            top(i, j) = at.own[0][i] + at.own[1][j] + at.g12[i] * p2[j] + hull.support(at.g13[i] + at.g23[j], corner);
    double best = top.maxCoeff();
    if (grid.carries_workpiece(1)) return search_cells(at, top);
    if (!grid.carries_workpiece(0)) return best;
    for (Index i = 0; i < at.sag[0].size(); ++i)
        for (Index j = 0; j < top.cols(); ++j) {
            if (!(std::max(top(i, j), top(i + 1, j)) + at.sag[0][i] > best)) continue;
            const auto end = [&](Index n, Index k) {
                return at.own[0][n] + at.own[1][j] + at.own[2][k] + at.g12[n] * p2[j] + (at.g13[n] + at.g23[j]) * p3[k];
            };
            for (Index k = 0; k < p3.size(); ++k)
                best = std::max(best, top_of_arc(end(i, k), end(i + 1, k), at.sag[0][i]));
        }
    return best;
}

// The same if the second axis is also quadratic between nodes.
double VolumeRanges::State::search_cells(const Terms& at, const ArrayXXd& top) const {
    const ArrayXd &p2 = grid.position(1), &p3 = grid.position(2);
    const int parts = grid.carries_workpiece(2) ? finer : 1;
    const double sag3 = std::max(at.sag[2].maxCoeff(), 0.0);
    double best = top.maxCoeff();
    const auto between = [](const ArrayXd& values, Index k, double t) {
        return values[k] + t * (values[k + 1] - values[k]);
    };
    // At node i of the first axis, and within intervals j and k of the others.
    const auto value = [&](Index i, Index j, double t, Index k, double u) {
        const double second = between(at.own[1], j, t) + 4.0 * t * (1.0 - t) * at.sag[1][j];
        const double third = between(at.own[2], k, u) + 4.0 * u * (1.0 - u) * at.sag[2][k];
        return at.own[0][i] + second + third + at.g12[i] * between(p2, j, t) +
               (at.g13[i] + between(at.g23, j, t)) * between(p3, k, u);
    };
    const auto highest_corner = [&](Index i, Index j, Index k) {
        double highest = -std::numeric_limits<double>::infinity();
        for (const Index a : {i, i + 1})
            for (const Index b : {j, j + 1})
                for (const Index c : {k, k + 1})
                    highest = std::max(highest, at.own[0][a] + at.own[1][b] + at.own[2][c] + at.g12[a] * p2[b] +
                                                    (at.g13[a] + at.g23[b]) * p3[c]);
        return highest;
    };
    for (Index i = 0; i < at.sag[0].size(); ++i)
        for (Index j = 0; j < at.sag[1].size(); ++j) {
            const double higher = std::max(at.sag[0][i], 0.0) + std::max(at.sag[1][j], 0.0) + sag3;
            if (!(top.block<2, 2>(i, j).maxCoeff() + higher > best)) continue;
            for (Index k = 0; k < at.sag[2].size(); ++k) {
                if (!(highest_corner(i, j, k) + higher > best)) continue;
                for (int b = 0; b <= finer; ++b)
                    for (int c = 0; c <= parts; ++c) {
                        const double t = double(b) / finer, u = double(c) / parts;
                        best = std::max(best, top_of_arc(value(i, j, t, k, u), value(i + 1, j, t, k, u), at.sag[0][i]));
                    }
            }
        }
    return best;
}

VolumeRanges::VolumeRanges(const Calibration& calibration, const Vector3d& tool) {
    auto state = std::make_unique<State>(
        State{VolumeGrid(calibration, node_positions(calibration), tool), {}, diagonal_rows(calibration, tool)});
    // Missing parameters at a point where no lever is 0.
    const Vector3d somewhere = calibration.volume.cwiseProduct(Vector3d(0.37, 0.61, 0.83));
    const auto deviations = deviations_at(calibration.chain, tool, somewhere);
    const EntryLayout layout(calibration);
    for (std::size_t c = 0; c < deviation_count; ++c) state->missing[c] = layout.missing(deviations[c]);
    for (std::size_t d = 0; d < 4; ++d) state->missing[deviation_count + d] = state->diagonals[d].missing;
    state_ = std::move(state);
}

VolumeRanges::~VolumeRanges() = default;
VolumeRanges::VolumeRanges(VolumeRanges&&) noexcept = default;

Ranges VolumeRanges::evaluate(const VectorXd& values) const {
    const VectorXd table = state_->grid.table(values);
    VolumeField field;
    state_->grid.field(table.data(), field);
    std::array<MatrixXd, 3> sags;
    for (std::size_t r = 0; r < 3; ++r) sags[r] = state_->sag(table.data(), r);
    Ranges ranges = Ranges::Zero();
    for (int c = 0; c < 3; ++c) {
        const auto i = std::size_t(c);
        for (const double sign : {1.0, -1.0}) {
            if (!state_->missing[i].empty()) continue;
            Terms terms{{}, {}, sign * field.g12[i], sign * field.g13[i], sign * field.g23[i]};
            for (std::size_t r = 0; r < 3; ++r) {
                terms.own[r] = sign * field.own[r][i];
                terms.sag[r] = sign * sags[r].col(c).array();
            }
            ranges[c] += state_->largest(terms);
        }
        for (std::size_t r = 0; r < 3; ++r) {  // rotations are sums of functions of one position
            const auto tilt = state_->grid.functions(table.data(), r).col(3 + c);
            ranges[c + 3] += tilt.maxCoeff() - tilt.minCoeff();
        }
    }
    for (int d = 0; d < 4; ++d) {
        const VectorXd along = state_->diagonals[std::size_t(d)].rows * values;
        ranges[deviation_count + d] = along.maxCoeff() - along.minCoeff();
    }
    for (int i = 0; i < range_count; ++i)
        if (!state_->missing[std::size_t(i)].empty()) ranges[i] = std::numeric_limits<double>::quiet_NaN();
    return ranges;
}

double VolumeRanges::resolution(const VectorXd& values) const {
    const VectorXd table = state_->grid.table(values);
    Vector3d sum = Vector3d::Zero();
    for (const std::size_t r : {1, 2}) sum += state_->sag(table.data(), r).cwiseAbs().colwise().maxCoeff();
    return sum.maxCoeff() / (finer * finer);
}

const std::array<std::vector<std::string>, range_count>& VolumeRanges::missing() const { return state_->missing; }

}  // namespace stepdiag
