// A draw is the calibration's own field and what is drawn beside it. The own field with bounds of the rest leaves few
// pairs (p1, p2) where an extreme can be. There the extremes of a component over p3 are at corners of the convex hulls
// of F3, which bound |e|, so that fewer pairs still need a search over p3.
#include "stepdiag/uncertainty/volume_draws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"
#include "stepdiag/plan/line.hpp"
#include "uncertainty/derived_parts.hpp"
#include "uncertainty/in_blocks.hpp"
#include "uncertainty/normal_draws.hpp"
#include "uncertainty/upper_hull.hpp"
#include "uncertainty/volume_field.hpp"

namespace stepdiag {
namespace {

using Eigen::Array3d;
using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void add(const VolumeField& a, const VolumeField& b, VolumeField& sum) {
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t r = 0; r < 3; ++r) sum.own[r][c] = a.own[r][c] + b.own[r][c];
        sum.g12[c] = a.g12[c] + b.g12[c];
        sum.g13[c] = a.g13[c] + b.g13[c];
        sum.g23[c] = a.g23[c] + b.g23[c];
    }
}

// The largest of a function of (p1, p2), with its largest by p1.
struct Ceiling {
    ArrayXXd at;  // p2, p1
    ArrayXd over_p2;
    Index first, second;  // p1 and p2 of the largest

    explicit Ceiling(ArrayXXd values) : at(std::move(values)), over_p2(at.colwise().maxCoeff()) {
        at.maxCoeff(&second, &first);
    }
};

// Of a sum of functions of p1, p2 and p3: each at its positions, but p3.
struct Excess {
    ArrayXd first, second;
    double third;
};

// Calls visit(p1, p2) wherever ceiling and excess together are above best(), which may grow meanwhile.
template <class Best, class Visit>
void where_above(const Ceiling& ceiling, const Excess& excess, Best&& best, Visit&& visit) {
    const double most_second = excess.second.maxCoeff();
    for (Index i = 0; i < ceiling.at.cols(); ++i) {
        const double first = excess.first[i] + excess.third;
        if (!(ceiling.over_p2[i] + first + most_second > best())) continue;
        for (Index j = 0; j < ceiling.at.rows(); ++j)
            if (ceiling.at(j, i) + first + excess.second[j] > best()) visit(i, j);
    }
}

}  // namespace

struct VolumeDraws::State {
    VolumeGrid grid;
    VectorXd table;  // of the calibration
    VolumeField field;
    MatrixXd covariance;  // of a table
    NormalDraws draws;    // of a table, beside the calibration's
    std::array<VectorXd, 3> weight;
    std::vector<Ceiling> ceilings;   // of the calibration's field: X, -X, Y, -Y, Z, -Z, |e|
    std::array<double, 3> farthest;  // largest |p|

    struct DiagonalPoint {
        std::array<Index, 3> interval;
        std::array<double, 3> t;
        Vector3d point;  // by rank
    };
    std::array<std::vector<DiagonalPoint>, 4> diagonals;
    std::array<Vector3d, 4> directions;

    void set_ceilings();
    void set_diagonals(const GridPositions& positions, const Chain& chain);
    // `rest` is what the field has beside the calibration's, `table` that of the field.
    template <class Row>
    void figures(const VolumeField& field, const VolumeField& rest, const double* table, Row&& row) const;
    // Fills in the largest error and the columns of its place.
    template <class Row>
    void largest(const VolumeField& field, const VolumeField& rest, Row&& row) const;
    double range(const VolumeField& field, const VolumeField& rest, std::size_t component) const;
    double mean_square(const VolumeField& field, std::size_t component) const;
    double diagonal(const VolumeField& field, std::size_t d) const;
};

void VolumeDraws::State::set_ceilings() {
    const ArrayXd &p2 = grid.position(1), &p3 = grid.position(2);
    const Index n1 = grid.position(0).size(), n2 = p2.size();
    std::array<ArrayXXd, 7> most;
    for (ArrayXXd& values : most) values.resize(n2, n1);
    for (Index i = 0; i < n1; ++i)
        for (Index j = 0; j < n2; ++j) {
            ArrayXd size2 = ArrayXd::Zero(p3.size());
            for (std::size_t c = 0; c < 3; ++c) {
                const ArrayXd e = field.own[2][c] + (field.g13[c][i] + field.g23[c][j]) * p3 +
                                  (field.own[0][c][i] + field.own[1][c][j] + field.g12[c][i] * p2[j]);
                most[2 * c](j, i) = e.maxCoeff();
                most[2 * c + 1](j, i) = -e.minCoeff();
                size2 += e.square();
            }
            most[6](j, i) = std::sqrt(size2.maxCoeff());
        }
    for (ArrayXXd& values : most) ceilings.emplace_back(std::move(values));
    for (std::size_t r = 0; r < 3; ++r) farthest[r] = grid.position(r).abs().maxCoeff();
}

void VolumeDraws::State::set_diagonals(const GridPositions& positions, const Chain& chain) {
    std::size_t most = 2;
    for (const auto& of_axis : positions) most = std::max(most, of_axis.size());
    const char* names[] = {"ppp", "npp", "pnp", "nnp"};
    for (std::size_t d = 0; d < 4; ++d) {
        const Line line = Line::parse(names[d]);
        Vector3d start, end;
        for (const Axis axis : all_axes) {
            const auto& of_axis = positions[std::size_t(index(axis))];
            const bool rises = line.sign(axis) > 0;
            start[index(axis)] = rises ? of_axis.front() : of_axis.back();
            end[index(axis)] = rises ? of_axis.back() : of_axis.front();
        }
        directions[d] = (end - start).normalized();
        for (std::size_t k = 0; k < most; ++k) {
            DiagonalPoint at;
            for (std::size_t r = 0; r < 3; ++r) {
                const int axis = index(chain.order()[r]);
                const double p = start[axis] + double(k) / double(most - 1) * (end[axis] - start[axis]);
                const ArrayXd& nodes = grid.position(r);
                const Index after = std::upper_bound(nodes.begin(), nodes.end(), p) - nodes.begin();
                const Index interval = std::clamp(after - 1, Index(0), nodes.size() - 2);
                at.interval[r] = interval;
                at.t[r] = (p - nodes[interval]) / (nodes[interval + 1] - nodes[interval]);
                at.point[Index(r)] = p;
            }
            diagonals[d].push_back(at);
        }
    }
}

template <class Row>
void VolumeDraws::State::largest(const VolumeField& f, const VolumeField& rest, Row&& row) const {
    const ArrayXd &p2 = grid.position(1), &p3 = grid.position(2);
    const auto length = [](const VolumeField::Component3& v) {
        return ArrayXd((v[0].square() + v[1].square() + v[2].square()).sqrt());
    };
    const Excess excess = {length(rest.own[0]) + farthest[1] * length(rest.g12) + farthest[2] * length(rest.g13),
                           length(rest.own[1]) + farthest[2] * length(rest.g23), length(rest.own[2]).maxCoeff()};
    const auto constant = [&](std::size_t c, Index i, Index j) {
        return f.own[0][c][i] + f.own[1][c][j] + f.g12[c][i] * p2[j];
    };
    const auto squares = [&](Index i, Index j) {
        return ArrayXd((f.own[2][0] + (f.g13[0][i] + f.g23[0][j]) * p3 + constant(0, i, j)).square() +
                       (f.own[2][1] + (f.g13[1][i] + f.g23[1][j]) * p3 + constant(1, i, j)).square() +
                       (f.own[2][2] + (f.g13[2][i] + f.g23[2][j]) * p3 + constant(2, i, j)).square());
    };
    double best = 0.0;
    GridPlace place = {ceilings[6].first, ceilings[6].second, 0};
    const auto search = [&](Index i, Index j) {
        const double size = std::sqrt(squares(i, j).maxCoeff());
        if (!(size > best)) return;
        best = size;
        place = {i, j, 0};
    };
    search(ceilings[6].first, ceilings[6].second);
    std::array<std::array<UpperHull, 2>, 3> hulls = {{{UpperHull(p3, f.own[2][0]), UpperHull(p3, -f.own[2][0])},
                                                      {UpperHull(p3, f.own[2][1]), UpperHull(p3, -f.own[2][1])},
                                                      {UpperHull(p3, f.own[2][2]), UpperHull(p3, -f.own[2][2])}}};
    std::array<std::array<std::size_t, 2>, 3> corners{};
    where_above(
        ceilings[6], excess, [&] { return best; },
        [&](Index i, Index j) {
            double bound2 = 0.0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double s = f.g13[c][i] + f.g23[c][j], a = constant(c, i, j);
                const double most =
                    std::max(a + hulls[c][0].support(s, corners[c][0]), hulls[c][1].support(-s, corners[c][1]) - a);
                bound2 += most * most;
            }
            if (std::sqrt(bound2) > best) search(i, j);
        });
    squares(place[0], place[1]).maxCoeff(&place[2]);
    const Vector3d error = grid.error(f, place), drawn = grid.error(rest, place);
    const Vector3d along = error.stableNormalized(), found = error - drawn;
    const Eigen::Matrix3d variance = grid.error_covariance(covariance, place);
    row[0] = best;
    row[found_at_largest] = along.dot(found);
    row[opposite_at_largest] = (found - drawn).norm();
    row[uncertainty_at_largest] = std::sqrt(std::max(along.dot(variance * along), 0.0));
    row[variance_at_largest] = variance.trace();
    row[variance2_at_largest] = variance.squaredNorm();
}

// Largest minus smallest value of a component of e.
double VolumeDraws::State::range(const VolumeField& f, const VolumeField& rest, std::size_t c) const {
    const ArrayXd &p2 = grid.position(1), &p3 = grid.position(2);
    double sum = 0.0;
    for (const double sign : {1.0, -1.0}) {
        const Excess excess = {
            sign * rest.own[0][c] + farthest[1] * rest.g12[c].abs() + farthest[2] * rest.g13[c].abs(),
            sign * rest.own[1][c] + farthest[2] * rest.g23[c].abs(), (sign * rest.own[2][c]).maxCoeff()};
        const UpperHull hull(p3, sign * f.own[2][c]);
        std::size_t corner = 0;
        double best = -std::numeric_limits<double>::infinity();
        const auto search = [&](Index i, Index j) {
            best = std::max(best, sign * (f.own[0][c][i] + f.own[1][c][j] + f.g12[c][i] * p2[j]) +
                                      hull.support(sign * (f.g13[c][i] + f.g23[c][j]), corner));
        };
        const Ceiling& ceiling = ceilings[2 * c + (sign > 0.0 ? 0 : 1)];
        search(ceiling.first, ceiling.second);
        where_above(ceiling, excess, [&] { return best; }, search);
        sum += best;
    }
    return sum;
}

// Mean of the square of a component of e over the box. The component is a sum of products of functions of p1, p2, p3,
// so that the means of products of two functions of each are enough.
double VolumeDraws::State::mean_square(const VolumeField& f, std::size_t c) const {
    const auto means = [&](std::size_t r, const std::vector<const ArrayXd*>& functions) {
        const Index n = Index(functions.size()) + 1;
        MatrixXd columns(weight[r].size(), n);
        columns.col(0).setOnes();
        for (Index k = 1; k < n; ++k) columns.col(k) = functions[std::size_t(k - 1)]->matrix();
        return MatrixXd(columns.transpose() * weight[r].asDiagonal() * columns);
    };
    const MatrixXd first = means(0, {&f.own[0][c], &f.g12[c], &f.g13[c]});
    const MatrixXd second = means(1, {&f.own[1][c], &grid.position(1), &f.g23[c]});
    const MatrixXd third = means(2, {&f.own[2][c], &grid.position(2)});
    constexpr int terms[6][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 2, 0}, {3, 0, 2}, {0, 3, 2}};
    double mean = 0.0;
    for (const auto& s : terms)
        for (const auto& t : terms) mean += first(s[0], t[0]) * second(s[1], t[1]) * third(s[2], t[2]);
    return mean;
}

double VolumeDraws::State::diagonal(const VolumeField& f, std::size_t d) const {
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
void VolumeDraws::State::figures(const VolumeField& f, const VolumeField& rest, const double* values, Row&& row) const {
    largest(f, rest, row);
    double mean2 = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
        mean2 += mean_square(f, c);
        row[2 + Index(c)] = range(f, rest, c);
        double least = 0.0, most = 0.0;  // tilts are sums of functions of one position
        for (std::size_t r = 0; r < 3; ++r) {
            const auto tilt = grid.functions(values, r).col(3 + Index(c));
            least += tilt.minCoeff();
            most += tilt.maxCoeff();
        }
        row[5 + Index(c)] = std::max(most, -least);
        row[8 + Index(c)] = most - least;
    }
    row[1] = std::sqrt(std::max(mean2, 0.0));
    for (std::size_t d = 0; d < 4; ++d) row[Index(11 + d)] = diagonal(f, d);
}

VolumeDraws::VolumeDraws(const Calibration& calibration, const GridPositions& positions,
                         const std::optional<Vector3d>& tool, std::uint64_t seed) {
    if (calibration.covariance.size() == 0)
        throw InvalidArgument("calibration: expected one evaluated with full covariance");
    check_grid(positions);
    for (const auto& of_axis : positions)
        if (of_axis.size() < 2) throw InvalidArgument("grid: expected at least two positions an axis");
    const VolumeGrid grid(calibration, positions, tool_of(calibration, tool));
    MatrixXd covariance = grid.covariance(calibration.covariance);
    NormalDraws normal(covariance, seed);
    auto state = std::make_unique<State>(State{grid,
                                               grid.table(calibration_values(calibration)),
                                               {},
                                               std::move(covariance),
                                               std::move(normal),
                                               {},
                                               {},
                                               {},
                                               {},
                                               {}});
    for (std::size_t r = 0; r < 3; ++r) {
        const std::vector<double> weights = trapezoidal_weights(positions[std::size_t(index(grid.axis(r)))]);
        state->weight[r] = Eigen::Map<const VectorXd>(weights.data(), Index(weights.size()));
    }
    grid.field(state->table.data(), state->field);
    state->set_ceilings();
    state->set_diagonals(positions, calibration.chain);
    state_ = std::move(state);
}

VolumeDraws::~VolumeDraws() = default;
VolumeDraws::VolumeDraws(VolumeDraws&&) noexcept = default;

Eigen::RowVectorXd VolumeDraws::values() const {
    const State& s = *state_;
    Eigen::RowVectorXd row(volume_columns);
    VolumeField nothing;
    s.grid.field(VectorXd::Zero(s.table.size()).eval().data(), nothing);
    s.figures(s.field, nothing, s.table.data(), row);
    return row;
}

VolumeDraws::Figures VolumeDraws::draw(std::uint64_t first, std::size_t count) const {
    const State& s = *state_;
    Figures result(Index(count), volume_columns);
    in_blocks(Index(count), NormalDraws::together, [&](Index begin, Index end) {
        MatrixXd tables;
        s.draws.draw(first + std::uint64_t(begin), tables);
        VolumeField rest, field;
        VectorXd table;
        for (Index draw = 0; draw < end - begin; ++draw) {
            s.grid.field(tables.col(draw).data(), rest);
            add(s.field, rest, field);
            table = s.table + tables.col(draw);
            s.figures(field, rest, table.data(), result.row(begin + draw));
        }
    });
    return result;
}

}  // namespace stepdiag
