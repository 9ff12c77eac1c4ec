// To first order, with axes 1, 2, 3 from workpiece to tool, the error is
//   e = F1(p1) + F2(p2) + F3(p3) + G12(p1) p2 + (G13(p1) + G23(p2)) p3
// For given p1 and p2 the extremes of a component over p3 are at corners of the convex hulls of F3. They bound |e|, so
// that few pairs (p1, p2) need a search over p3.
#include "stepdiag/uncertainty/volume_draws.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/block_product.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/plan/line.hpp"
#include "uncertainty/derived_parts.hpp"
#include "uncertainty/in_blocks.hpp"
#include "uncertainty/normal_draws.hpp"
#include "uncertainty/upper_hull.hpp"

namespace stepdiag {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Component3 = std::array<ArrayXd, 3>;  // by component

constexpr Index together = 48;  // draws of one product: a multiple of 6
constexpr Index panel = 48;     // columns of the triangular root that are multiplied at once

// F and G of one draw at the grid points.
struct Field {
    std::array<Component3, 3> own;
    Component3 g12, g13, g23;
    std::array<std::array<double, 2>, 3> tilt{};  // sums of the lowest and the highest, by component
};

}  // namespace

struct VolumeDraws::State {
    Chain chain;
    Vector3d tool;
    std::uint64_t seed;
    std::array<ArrayXd, 3> position, weight;  // in the order of the chain
    VectorXd table;                           // of the calibration: delta, theta by axis and grid point
    MatrixXd root;                            // triangular in the order of `place`, negative; with spare rows
    std::vector<Index> place;                 // of each row of the root in the table
    VectorXd scale;                           // of each row of the root
    Index rank = 0;                           // columns of the root

    struct DiagonalPoint {
        std::array<Index, 3> interval;
        std::array<double, 3> t;
        Vector3d point;  // by rank
    };
    std::array<std::vector<DiagonalPoint>, 4> diagonals;
    std::array<Vector3d, 4> directions;

    Index first(std::size_t rank_of_axis) const;
    Field field(const double* table) const;
    template <class Row>
    void figures(const Field& field, Row&& row) const;
    double largest(const Field& field, Vector3d& low, Vector3d& high, double& mean2) const;
    double diagonal(const Field& field, std::size_t d) const;
};

Index VolumeDraws::State::first(std::size_t r) const {
    Index at = 0;
    for (std::size_t before = 0; before < r; ++before) at += 6 * position[before].size();
    return at;
}

Field VolumeDraws::State::field(const double* values) const {
    Field f;
    const auto order = chain.order();
    const auto slopes = [&](Eigen::Map<const MatrixXd> at, std::size_t after) {
        Component3 g;
        const int k = index(order[after]), i = (k + 1) % 3, j = (k + 2) % 3;
        g[std::size_t(k)] = ArrayXd::Zero(at.cols());
        g[std::size_t(i)] = at.row(3 + j);  // theta x e_k = (.., theta_j, -theta_i), cyclically
        g[std::size_t(j)] = -at.row(3 + i).array();
        return g;
    };
    for (std::size_t r = 0; r < 3; ++r) {
        const Index n = position[r].size();
        const Eigen::Map<const MatrixXd> at(values + first(r), 6, n);
        for (int c = 0; c < 3; ++c) {
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            const auto lever = [&](int of) -> ArrayXd {
                const bool along = chain.carries_workpiece(order[r]) && index(order[r]) == of;
                return along ? ArrayXd(tool[of] + position[r]) : ArrayXd(ArrayXd::Constant(n, tool[of]));
            };
            f.own[r][std::size_t(c)] = at.row(c).transpose().array() + at.row(3 + a).transpose().array() * lever(b) -
                                       at.row(3 + b).transpose().array() * lever(a);
            f.tilt[std::size_t(c)][0] += at.row(3 + c).minCoeff();
            f.tilt[std::size_t(c)][1] += at.row(3 + c).maxCoeff();
        }
        if (r == 0) {
            f.g12 = slopes(at, 1);
            f.g13 = slopes(at, 2);
        }
        if (r == 1) f.g23 = slopes(at, 2);
    }
    return f;
}

// Largest |e|, the extremes of the components, and the mean of |e|^2.
double VolumeDraws::State::largest(const Field& f, Vector3d& low, Vector3d& high, double& mean2) const {
    const ArrayXd &p2 = position[1], &p3 = position[2];
    const Index n1 = position[0].size(), n2 = p2.size();
    ArrayXd bound = ArrayXd::Zero(n1 * n2);  // of |e|^2 over p3
    const double mean_p = (weight[2] * p3).sum(), mean_pp = (weight[2] * p3 * p3).sum();
    mean2 = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
        const ArrayXd& third = f.own[2][c];
        const UpperHull top(p3, third), bottom(p3, -third);
        std::size_t top_corner = 0, bottom_corner = 0;
        const double mean_f = (weight[2] * third).sum(), mean_ff = (weight[2] * third * third).sum(),
                     mean_fp = (weight[2] * third * p3).sum();
        double highest = -1e300, lowest = 1e300;
        for (Index i = 0; i < n1; ++i) {
            double mean_of_row = 0.0;
            for (Index j = 0; j < n2; ++j) {
                const double s = f.g13[c][i] + f.g23[c][j];
                const double a = f.own[0][c][i] + f.own[1][c][j] + f.g12[c][i] * p2[j];
                const double up = a + top.support(s, top_corner), down = a - bottom.support(-s, bottom_corner);
                const double most = std::max(up, -down);
                bound[i * n2 + j] += most * most;
                highest = std::max(highest, up);
                lowest = std::min(lowest, down);
                mean_of_row += weight[1][j] *
                               (a * (a + 2.0 * (mean_f + s * mean_p)) + mean_ff + s * (2.0 * mean_fp + s * mean_pp));
            }
            mean2 += weight[0][i] * mean_of_row;
        }
        low[Index(c)] = lowest;
        high[Index(c)] = highest;
    }
    double best = -1.0;
    const auto search = [&](Index at) {
        if (!(bound[at] > best)) return;
        const Index i = at / n2, j = at % n2;
        ArrayXd size2 = ArrayXd::Zero(p3.size());
        for (std::size_t c = 0; c < 3; ++c)
            size2 += (f.own[2][c] + (f.g13[c][i] + f.g23[c][j]) * p3 +
                      (f.own[0][c][i] + f.own[1][c][j] + f.g12[c][i] * p2[j]))
                         .square();
        best = std::max(best, size2.maxCoeff());
    };
    Index likely;
    bound.maxCoeff(&likely);
    search(likely);
    for (Index at = 0; at < bound.size(); ++at) search(at);
    return std::sqrt(best);
}

double VolumeDraws::State::diagonal(const Field& f, std::size_t d) const {
    double low = 0.0, high = 0.0, start = 0.0;
    bool is_first = true;
    for (const DiagonalPoint& at : diagonals[d]) {
        const auto between = [&](const ArrayXd& values, std::size_t r) {
            return values[at.interval[r]] + at.t[r] * (values[at.interval[r] + 1] - values[at.interval[r]]);
        };
        double along = 0.0;
        for (std::size_t c = 0; c < 3; ++c)
            along += directions[d][Index(c)] *
                     (between(f.own[0][c], 0) + between(f.own[1][c], 1) + between(f.own[2][c], 2) +
                      between(f.g12[c], 0) * at.point[1] + (between(f.g13[c], 0) + between(f.g23[c], 1)) * at.point[2]);
        if (is_first) start = along;
        is_first = false;
        low = std::min(low, along - start);
        high = std::max(high, along - start);
    }
    return high - low;
}

template <class Row>
void VolumeDraws::State::figures(const Field& f, Row&& row) const {
    Vector3d low, high;
    double mean2;
    row[0] = largest(f, low, high, mean2);
    row[1] = std::sqrt(std::max(mean2, 0.0));
    for (int c = 0; c < 3; ++c) {
        const auto& [least, most] = f.tilt[std::size_t(c)];
        row[2 + c] = high[c] - low[c];
        row[5 + c] = std::max(most, -least);
        row[8 + c] = most - least;
    }
    for (std::size_t d = 0; d < 4; ++d) row[Index(11 + d)] = diagonal(f, d);
}

VolumeDraws::VolumeDraws(const Calibration& calibration, const GridPositions& grid, const std::optional<Vector3d>& tool,
                         std::uint64_t seed) {
    if (calibration.covariance.size() == 0)
        throw InvalidArgument("calibration: expected one evaluated with full covariance");
    check_grid(grid);
    for (const auto& positions : grid)
        if (positions.size() < 2) throw InvalidArgument("grid: expected at least two positions an axis");
    auto state = std::make_unique<State>(
        State{calibration.chain, tool_of(calibration, tool), seed, {}, {}, {}, {}, {}, {}, 0, {}, {}});
    State& s = *state;
    const auto order = s.chain.order();
    const EntryLayout layout(calibration);
    std::vector<std::vector<EntryLayout::Weighted>> rows;  // of the table, by the calibration's values
    for (std::size_t r = 0; r < 3; ++r) {
        const auto& positions = grid[std::size_t(index(order[r]))];
        s.position[r] = Eigen::Map<const ArrayXd>(positions.data(), Index(positions.size()));
        const std::vector<double> weights = trapezoidal_weights(positions);
        s.weight[r] = Eigen::Map<const ArrayXd>(weights.data(), Index(weights.size()));
        for (const double p : positions)
            for (int c = 0; c < 6; ++c) {
                auto& row = rows.emplace_back();
                const int function = FunctionId{order[r], Component(c)}.index();
                if (layout.has(function))
                    for (const auto& node : layout.interpolation(function, p)) row.push_back(node);
                for (const Squareness q : all_squarenesses) {
                    const SquarenessTerm term = squareness_term(q);
                    const int parameter = function_count + static_cast<int>(q);
                    if (term.axis == order[r] && term.component == c && layout.has(parameter))
                        row.push_back({layout.first(parameter), term.sign * p});
                }
            }
    }
    const Index n = Index(rows.size());
    const VectorXd values = calibration_values(calibration);
    s.table = VectorXd::Zero(n);
    MatrixXd half = MatrixXd::Zero(layout.size(), n);
    for (Index i = 0; i < n; ++i)
        for (const auto& [entry, weight] : rows[std::size_t(i)]) {
            s.table[i] += weight * values[entry];
            half.col(i) += weight * calibration.covariance.col(entry);
        }
    MatrixXd covariance = MatrixXd::Zero(n, n);
    const MatrixXd half_rows = half.transpose();
    for (Index i = 0; i < n; ++i)
        for (const auto& [entry, weight] : rows[std::size_t(i)]) covariance.col(i) += weight * half_rows.col(entry);
    const PivotedRoot root(covariance);
    s.rank = root.rank;
    s.place = root.place;
    s.scale = root.scale;
    s.root = MatrixXd::Zero(n + widest_vector, s.rank);
    s.root.topRows(n) = -root.lower;

    std::size_t most = 2;
    for (const auto& positions : grid) most = std::max(most, positions.size());
    const char* names[] = {"ppp", "npp", "pnp", "nnp"};
    for (std::size_t d = 0; d < 4; ++d) {
        const Line line = Line::parse(names[d]);
        Vector3d start, end;
        for (const Axis axis : all_axes) {
            const auto& positions = grid[std::size_t(index(axis))];
            const bool rises = line.sign(axis) > 0;
            start[index(axis)] = rises ? positions.front() : positions.back();
            end[index(axis)] = rises ? positions.back() : positions.front();
        }
        s.directions[d] = (end - start).normalized();
        for (std::size_t k = 0; k < most; ++k) {
            State::DiagonalPoint at;
            for (std::size_t r = 0; r < 3; ++r) {
                const int axis = index(order[r]);
                const double p = start[axis] + double(k) / double(most - 1) * (end[axis] - start[axis]);
                const ArrayXd& positions = s.position[r];
                const Index after = std::upper_bound(positions.begin(), positions.end(), p) - positions.begin();
                const Index interval = std::clamp(after - 1, Index(0), positions.size() - 2);
                at.interval[r] = interval;
                at.t[r] = (p - positions[interval]) / (positions[interval + 1] - positions[interval]);
                at.point[Index(r)] = p;
            }
            s.diagonals[d].push_back(at);
        }
    }
    state_ = std::move(state);
}

VolumeDraws::~VolumeDraws() = default;
VolumeDraws::VolumeDraws(VolumeDraws&&) noexcept = default;

Eigen::RowVectorXd VolumeDraws::values() const {
    Eigen::RowVectorXd row(int(volume_figures.size()));
    state_->figures(state_->field(state_->table.data()), row);
    return row;
}

VolumeDraws::Figures VolumeDraws::draw(std::uint64_t first, std::size_t count) const {
    const State& s = *state_;
    const Index n = s.table.size();
    Figures result(Index(count), int(volume_figures.size()));
    in_blocks(Index(count), together, [&](Index begin, Index end) {
        const MatrixXd numbers = normal_numbers(s.seed, first + std::uint64_t(begin), s.rank, together);
        MatrixXd product = MatrixXd::Zero(n + widest_vector, together);
        for (Index k = 0; k < s.rank; k += panel)
            subtract_product(n - k, together, std::min(panel, s.rank - k), {&s.root(k, k), s.root.rows()},
                             {&numbers(k, 0), numbers.rows(), 1}, {&product(k, 0), product.rows()});
        VectorXd table(n);
        for (Index draw = 0; draw < end - begin; ++draw) {
            for (Index i = 0; i < n; ++i) {
                const Index at = s.place[std::size_t(i)];
                table[at] = s.table[at] + s.scale[i] * product(i, draw);
            }
            s.figures(s.field(table.data()), result.row(begin + draw));
        }
    });
    return result;
}

}  // namespace stepdiag
