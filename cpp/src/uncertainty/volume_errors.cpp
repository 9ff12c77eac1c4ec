#include "stepdiag/uncertainty/volume_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "machine/pose-inl.hpp"
#include "stepdiag/core/error.hpp"
#include "uncertainty/functional.hpp"
#include "uncertainty/in_blocks.hpp"

namespace stepdiag {
namespace {

using namespace STEPDIAG_NAMESPACE;
using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::Vector3d;
using Motion = AxisMotion<double>;

// Rotation vector of a matrix whose rotation is far below a quarter turn.
Vector3<double> rotation_vector(double x, double y, double z) {
    const double sine = std::sqrt(x * x + y * y + z * z);
    const double factor = sine > 1e-6 ? std::asin(std::min(sine, 1.0)) / sine : 1.0 + sine * sine / 6.0;
    return {factor * x, factor * y, factor * z};
}

Motion motion_of(const Chain& chain, Axis axis, double position, const Vector3d& delta, const Vector3d& theta) {
    const Vector3d shift = position * Vector3d::Unit(index(axis)) + delta;
    return {rotation_exp(broadcast3<double>(theta)), broadcast3<double>(shift), chain.carries_workpiece(axis)};
}

Vector3<double> tilt_of(const Matrix3<double>& one, const Matrix3<double>& rest) {
    const Matrix3<double> r = one * rest;
    return rotation_vector(0.5 * (r.row2.y - r.row1.z), 0.5 * (r.row0.z - r.row2.x), 0.5 * (r.row1.x - r.row0.y));
}

// What one position of the axis nearest to the workpiece contributes.
struct Slab {
    double largest2 = -1.0, weighted2 = 0.0;
    std::array<Index, 2> at{};  // positions of the other two axes
    Vector3d components;
    Vector3d lowest, highest, tilt_lowest, tilt_highest;
};

void widen(Vector3d& lowest, Vector3d& highest, int c, double low, double high) {
    lowest[c] = std::min(lowest[c], low);
    highest[c] = std::max(highest[c], high);
}

// Linear functions of one axis at the nodes of any of them: delta without squarenesses, and theta.
struct AxisFunctions {
    std::vector<double> position;
    std::vector<std::array<double, 6>> value;
    std::array<double, 3> slope{};  // of delta, by squarenesses

    AxisFunctions(const ErrorMap& errors, Axis axis) {
        for (int c = 0; c < 6; ++c)
            if (const auto& table = errors.table().functions[std::size_t(FunctionId{axis, Component(c)}.index())])
                position.insert(position.end(), table->position.begin(), table->position.end());
        if (position.empty()) position.push_back(0.0);
        std::sort(position.begin(), position.end());
        position.erase(std::unique(position.begin(), position.end()), position.end());
        for (const double p : position) {
            auto& at = value.emplace_back();
            for (int c = 0; c < 6; ++c) at[std::size_t(c)] = errors.function({axis, Component(c)}, p);
        }
        for (const Squareness s : all_squarenesses)
            if (const SquarenessTerm term = squareness_term(s); term.axis == axis)
                slope[std::size_t(term.component)] += term.sign * errors.squareness(s);
    }
    Motion motion(const Chain& chain, Axis axis, double p) const {
        const auto after = std::size_t(std::upper_bound(position.begin(), position.end(), p) - position.begin());
        const std::size_t high = std::min(after, position.size() - 1), low = after > 0 ? after - 1 : 0;
        const double t = high > low ? (p - position[low]) / (position[high] - position[low]) : 0.0;
        std::array<double, 6> v;
        for (std::size_t c = 0; c < 6; ++c) v[c] = value[low][c] + t * (value[high][c] - value[low][c]);
        for (std::size_t c = 0; c < 3; ++c) v[c] += slope[c] * p;
        return motion_of(chain, axis, p, {v[0], v[1], v[2]}, {v[3], v[4], v[5]});
    }
};

}  // namespace

Machine without_parameters(const Machine& machine, const std::vector<int>& parameters) {
    ParameterTable table = machine.errors().table();
    for (const int parameter : parameters) {
        if (parameter < function_count) {
            table.functions[std::size_t(parameter)].reset();
            table.negative_functions[std::size_t(parameter)].reset();
        } else {
            table.squarenesses[std::size_t(parameter - function_count)].reset();
        }
    }
    return {machine.chain(), ErrorMap(std::move(table)), machine.tool()};
}

void check_grid(const GridPositions& grid) {
    for (const Axis axis : all_axes) {
        const auto& positions = grid[std::size_t(index(axis))];
        bool ascends = !positions.empty();
        for (std::size_t k = 0; k < positions.size(); ++k)
            ascends = ascends && std::isfinite(positions[k]) && (k == 0 || positions[k] > positions[k - 1]);
        if (!ascends)
            throw InvalidArgument(std::string("grid: expected finite, ascending positions of ") + letter(axis));
    }
}

std::vector<double> trapezoidal_weights(const std::vector<double>& positions) {
    const std::size_t n = positions.size();
    const double length = positions.back() - positions.front();
    if (n == 1) return {1.0};
    std::vector<double> weights(n, 0.0);
    for (std::size_t k = 0; k + 1 < n; ++k) {
        const double half = (positions[k + 1] - positions[k]) / (2.0 * length);
        weights[k] += half;
        weights[k + 1] += half;
    }
    return weights;
}

namespace {

// The poses of a machine over a grid. Axes are in the order of the chain, workpiece to tool.
class PosesOfGrid {
public:
    PosesOfGrid(const Machine& machine, const GridPositions& grid, bool tilts)
        : tool_(machine.tool()), order_(machine.chain().order()), tilts_(tilts) {
        for (std::size_t r = 0; r < 3; ++r) {
            positions_[r] = &grid[std::size_t(index(order_[r]))];
            weights_[r] = trapezoidal_weights(*positions_[r]);
            for (const double p : *positions_[r])
                motions_[r].push_back(motion_of(machine.chain(), order_[r], p, machine.errors().delta(order_[r], p),
                                                machine.errors().theta(order_[r], p)));
        }
        move_by_two_axes();
    }
    Index slabs() const { return Index(motions_[0].size()); }

    Slab slab(Index i) const {
        Slab slab;
        slab.lowest = slab.tilt_lowest = Vector3d::Constant(infinite);
        slab.highest = slab.tilt_highest = Vector3d::Constant(-infinite);
        Vector3d nominal = tool_;
        nominal[index(order_[0])] += (*positions_[0])[std::size_t(i)];
        const Motion& first = motions_[0][std::size_t(i)];
        const Index n2 = Index(motions_[1].size()), n3 = Index(motions_[2].size());
        for (Index j = 0; j < n2; ++j) {
            nominal[index(order_[1])] = tool_[index(order_[1])] + (*positions_[1])[std::size_t(j)];
            add_errors(first, nominal, j, slab);
            for (Index k = 0; tilts_ && k < n3; ++k) {
                const Vector3<double> tilt = tilt_of(first.rotation, rotations_[std::size_t(j * n3 + k)]);
                widen(slab.tilt_lowest, slab.tilt_highest, 0, tilt.x, tilt.x);
                widen(slab.tilt_lowest, slab.tilt_highest, 1, tilt.y, tilt.y);
                widen(slab.tilt_lowest, slab.tilt_highest, 2, tilt.z, tilt.z);
            }
        }
        return slab;
    }

    VolumeSummary summary(const std::vector<Slab>& slabs) const {
        VolumeSummary summary;
        summary.lowest = summary.tilt_lowest = Vector3d::Constant(infinite);
        summary.highest = summary.tilt_highest = Vector3d::Constant(-infinite);
        double largest2 = -1.0, mean2 = 0.0;
        for (std::size_t i = 0; i < slabs.size(); ++i) {
            const Slab& slab = slabs[i];
            mean2 += weights_[0][i] * slab.weighted2;
            summary.lowest = summary.lowest.cwiseMin(slab.lowest);
            summary.highest = summary.highest.cwiseMax(slab.highest);
            summary.tilt_lowest = summary.tilt_lowest.cwiseMin(slab.tilt_lowest);
            summary.tilt_highest = summary.tilt_highest.cwiseMax(slab.tilt_highest);
            if (!(slab.largest2 > largest2)) continue;
            largest2 = slab.largest2;
            summary.components = slab.components;
            summary.largest_at[index(order_[0])] = (*positions_[0])[i];
            for (std::size_t r : {1, 2})
                summary.largest_at[index(order_[r])] = (*positions_[r])[std::size_t(slab.at[r - 1])];
        }
        summary.largest = std::sqrt(largest2);
        summary.rms = std::sqrt(mean2);
        return summary;
    }

private:
    static constexpr double infinite = std::numeric_limits<double>::infinity();

    // Functional point by component, and orientation, in the frame before the second axis.
    void move_by_two_axes() {
        const Index n2 = Index(motions_[1].size()), n3 = Index(motions_[2].size());
        for (ArrayXXd& component : points_) component.resize(n3, n2);
        if (tilts_) rotations_.resize(std::size_t(n2 * n3));
        const Vector3<double> tool = broadcast3<double>(tool_);
        for (Index k = 0; k < n3; ++k) {
            const Motion& third = motions_[2][std::size_t(k)];
            const Vector3<double> carried = move_point(third, tool).point;
            for (Index j = 0; j < n2; ++j) {
                const Motion& second = motions_[1][std::size_t(j)];
                const Vector3<double> point = move_point(second, carried).point;
                points_[0](k, j) = point.x, points_[1](k, j) = point.y, points_[2](k, j) = point.z;
                if (tilts_) rotations_[std::size_t(j * n3 + k)] = second.rotation * third.rotation;
            }
        }
    }

    // Those at all positions of the third axis, at position j of the second.
    void add_errors(const Motion& first, const Vector3d& nominal, Index j, Slab& slab) const {
        const Index n3 = Index(motions_[2].size());
        const Eigen::Map<const ArrayXd> along_third(positions_[2]->data(), n3), weight(weights_[2].data(), n3);
        const Vector3<double> origin = move_point(first, broadcast3<double>(Vector3d::Zero())).point;
        const Vector3<double> rows[] = {first.rotation.row0, first.rotation.row1, first.rotation.row2};
        const double origins[] = {origin.x, origin.y, origin.z};
        std::array<ArrayXd, 3> e;
        ArrayXd size2 = ArrayXd::Zero(n3);
        for (int c = 0; c < 3; ++c) {
            ArrayXd& own = e[std::size_t(c)];
            own = rows[c].x * points_[0].col(j) + rows[c].y * points_[1].col(j) + rows[c].z * points_[2].col(j) +
                  (origins[c] - nominal[c]);
            if (c == index(order_[2])) own -= along_third;
            size2 += own.square();
            widen(slab.lowest, slab.highest, c, own.minCoeff(), own.maxCoeff());
        }
        slab.weighted2 += weights_[1][std::size_t(j)] * (weight * size2).sum();
        if (const double most = size2.maxCoeff(); most > slab.largest2) {
            Index k;
            slab.largest2 = size2.maxCoeff(&k);
            slab.at = {j, k};
            slab.components = {e[0][k], e[1][k], e[2][k]};
        }
    }

    Vector3d tool_;
    std::array<Axis, 3> order_;
    bool tilts_;
    std::array<const std::vector<double>*, 3> positions_;
    std::array<std::vector<double>, 3> weights_;
    std::array<std::vector<Motion>, 3> motions_;
    std::array<ArrayXXd, 3> points_;
    std::vector<Matrix3<double>> rotations_;
};

}  // namespace

VolumeSummary summarise_volume(const Machine& machine, const GridPositions& grid, bool tilts) {
    check_grid(grid);
    const PosesOfGrid poses(machine, grid, tilts);
    std::vector<Slab> slabs(std::size_t(poses.slabs()));
    in_blocks(poses.slabs(), 1, [&](Index i, Index) { slabs[std::size_t(i)] = poses.slab(i); });
    return poses.summary(slabs);
}

SixRows errors_at(const Machine& machine, const PointRows& points) {
    if (!points.allFinite()) throw InvalidArgument("points: expected finite positions in mm");
    const auto order = machine.chain().order();
    const std::array functions = {AxisFunctions(machine.errors(), order[0]), AxisFunctions(machine.errors(), order[1]),
                                  AxisFunctions(machine.errors(), order[2])};
    const Vector3<double> tool = broadcast3<double>(machine.tool());
    SixRows errors(points.rows(), 6);
    in_blocks(points.rows(), 1024, [&](Index begin, Index end) {
        for (Index i = begin; i < end; ++i) {
            const auto motion = [&](std::size_t r) {
                return functions[r].motion(machine.chain(), order[r], points(i, index(order[r])));
            };
            const Motion axes[3] = {motion(0), motion(1), motion(2)};
            const Vector3<double> p = chain_pose(axes, tool).position;
            const Vector3<double> tilt = tilt_of(axes[0].rotation, axes[1].rotation * axes[2].rotation);
            errors.row(i) << p.x - points(i, 0) - tool.x, p.y - points(i, 1) - tool.y, p.z - points(i, 2) - tool.z,
                tilt.x, tilt.y, tilt.z;
        }
    });
    return errors;
}

namespace {

// at(point, component, entries): what a deviation is the sum of, by the values of a calibration; none where a parameter
// is missing.
template <class At>
void for_deviations(const Calibration& calibration, const Vector3d& tool, const PointRows& points, const At& at) {
    if (!points.allFinite()) throw InvalidArgument("points: expected finite positions in mm");
    const EntryLayout layout(calibration);
    // Where no lever is 0. What is missing nowhere need not be looked for at every point.
    const auto somewhere = deviations_at(calibration.chain, tool, {0.37, 0.61, 0.83});
    std::array<bool, 6> complete;
    for (std::size_t c = 0; c < 6; ++c) complete[c] = layout.missing(somewhere[c]).empty();
    in_blocks(points.rows(), 256, [&](Index begin, Index end) {
        std::vector<EntryLayout::Weighted> entries;
        for (Index i = begin; i < end; ++i) {
            const auto deviations = deviations_at(calibration.chain, tool, points.row(i).transpose());
            for (std::size_t c = 0; c < 6; ++c) {
                entries.clear();
                if (!complete[c] && !layout.missing(deviations[c]).empty()) {
                    at(i, Index(c), nullptr);
                    continue;
                }
                for (const Term& term : deviations[c]) {
                    if (!layout.has(term.parameter)) continue;
                    if (term.parameter >= function_count)
                        entries.push_back({layout.first(term.parameter), term.coefficient});
                    else
                        for (const auto& [entry, weight] : layout.interpolation(term.parameter, term.position))
                            entries.push_back({entry, weight * term.coefficient});
                }
                at(i, Index(c), &entries);
            }
        }
    });
}

}  // namespace

SixRows error_uncertainties_at(const Calibration& calibration, const Vector3d& tool, const PointRows& points) {
    if (calibration.covariance.size() == 0)
        throw InvalidArgument("calibration: expected one evaluated with full covariance");
    const Eigen::MatrixXd& covariance = calibration.covariance;
    SixRows uncertainties(points.rows(), 6);
    for_deviations(calibration, tool, points, [&](Index i, Index c, const std::vector<EntryLayout::Weighted>* entries) {
        if (!entries) {
            uncertainties(i, c) = std::numeric_limits<double>::quiet_NaN();
            return;
        }
        double variance = 0.0;
        for (std::size_t a = 0; a < entries->size(); ++a) {
            const auto& [entry, weight] = (*entries)[a];
            const double* column = covariance.col(entry).data();
            double sum = 0.5 * weight * column[entry];
            for (std::size_t b = 0; b < a; ++b) sum += (*entries)[b].weight * column[(*entries)[b].entry];
            variance += 2.0 * weight * sum;
        }
        uncertainties(i, c) = std::sqrt(std::max(variance, 0.0));
    });
    return uncertainties;
}

Eigen::MatrixXd error_changes_at(const Calibration& calibration, const Vector3d& tool, const PointRows& points,
                                 const Eigen::MatrixXd& changes) {
    if (const Index size = EntryLayout(calibration).size(); changes.rows() != size)
        throw InvalidArgument("changes: expected those of " + std::to_string(size) + " entries, got " +
                              std::to_string(changes.rows()));
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(6 * points.rows(), changes.cols());
    for_deviations(calibration, tool, points, [&](Index i, Index c, const std::vector<EntryLayout::Weighted>* entries) {
        auto row = moved.row(6 * i + c);
        if (!entries) row.setConstant(std::numeric_limits<double>::quiet_NaN());
        else
            for (const auto& [entry, weight] : *entries) row += weight * changes.row(entry);
    });
    return moved;
}

}  // namespace stepdiag
