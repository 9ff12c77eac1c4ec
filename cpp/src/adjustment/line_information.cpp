#include "stepdiag/adjustment/line_information.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/solution.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
// Below this part of what a line tells of an unknown, what its set-up leaves of it is rounding.
constexpr double left_by_set_up = 1e-9;
// Below this, the functional point does not move by an error: mm by 1 mm, or by 1 rad.
constexpr double moves = 1e-9;

// A line's normal equations for the machine, and their diagonal before the set-up was eliminated.
struct Equations {
    MatrixXd matrix;  // lower triangle
    VectorXd diagonal;

    explicit Equations(Index size) : matrix(MatrixXd::Zero(size, size)), diagonal(VectorXd::Zero(size)) {}
    void add(const Equations& other) {
        matrix.triangularView<Eigen::Lower>() += other.matrix;
        diagonal += other.diagonal;
    }
};

// At zero errors, where it is decided what is determined, and at the machine's own.
struct LineEquations {
    Equations at_zero, at_machine;
};

// The six errors of an axis at a position of the grid: those of the nodes around it, by their shares.
struct AxisPlace {
    std::array<double, 2> share;
    std::array<std::array<int, 6>, 2> unknown;
    bool is_visited = true;  // both, where they have a share
};

// A point of the grid: its places, and how the axes' errors there move the functional point.
struct GridPoint {
    std::array<int, 3> place;
    Eigen::Matrix<double, 3, 18> by_errors;
};

using ErrorCovariance = Eigen::Matrix<double, 6, 6>;  // of the errors at one place with those at another one

// Of the volume, equidistant.
struct Grid {
    std::vector<AxisPlace> places;  // of X, Y, Z
    std::vector<GridPoint> points;

    Grid(const AdjustmentProblem& problem, int positions);
    // As of KnownByLines. `covariance(i, j)`: of places j <= i.
    VectorXd variances(const std::vector<bool>& determined,
                       const std::function<ErrorCovariance(std::size_t, std::size_t)>& covariance) const;
};

AdjustmentProblem problem_of(const Measurement& run, const Plan& plan, const Chain& chain, const Vector3d& tool,
                             const HeadCalibrations& heads, const AdjustmentOptions& options) {
    AdjustmentProblem problem(run, plan, chain, tool, heads, options);
    if (problem.readings().empty())
        throw InvalidArgument("adjustment: nothing can be determined: the run has no readings that count");
    if (!problem.coefficients().empty() || options.smoothness || options.distance_scale_uncertainty > 0.0 ||
        options.air_index_uncertainty > 0.0)
        throw InvalidArgument(
            "lines: expected nothing but the machine that they have in common, got expansion "
            "coefficients, drifts, smoothness, or an uncertain scale of distances");
    return problem;
}

[[noreturn]] void refuse_unsolved() {
    throw InvalidArgument("adjustment: finds no machine and set-up that explain the readings");
}

// All but the volume.
KnownByLines known_parameters(const CalibratedForms& forms, const BorderedBand& inverse, const Plan& plan) {
    KnownByLines known;
    known.largest.fill(not_known);
    known.whole.fill(false);
    for (int i = 0; i < function_count; ++i) {
        if (!forms.functions[i]) continue;
        double variance = 0.0;
        for (const LinearForm& form : forms.functions[i]->value) variance = std::max(variance, form.variance(inverse));
        known.largest[i] = std::sqrt(variance);
        known.whole[i] = forms.slope_determined[i] && int(forms.functions[i]->value.size()) == plan.steps() + 1;
    }
    for (int s = 0; s < squareness_count; ++s)
        if (forms.squarenesses[s]) {
            known.largest[function_count + s] = std::sqrt(std::max(0.0, forms.squarenesses[s]->variance(inverse)));
            known.whole[function_count + s] = true;
        }
    return known;
}

bool has(const std::vector<ChosenLine>& lines, const std::vector<ChosenLine>& some) {
    return std::all_of(some.begin(), some.end(), [&](const ChosenLine& one) {
        return std::any_of(lines.begin(), lines.end(), [&](const ChosenLine& other) {
            return other.is_scale_line == one.is_scale_line && other.name == one.name;
        });
    });
}

// By the problem's unknown: that of the first run for the same error, or no_unknown for those of set-ups.
std::vector<int> common_unknowns(const AdjustmentProblem& problem, const AdjustmentProblem& first) {
    std::vector<int> common(std::size_t(problem.size()), no_unknown);
    for (const AxisNode& node : problem.nodes()) {
        const AxisNode* same = first.find(node.axis, node.node, node.negative);
        if (!same) throw InvalidArgument("lines: expected those of the first run to visit every node");
        for (int c = 0; c < 6; ++c)
            if (node.unknown[c] != no_unknown) common[node.unknown[c]] = same->unknown[c];
    }
    return common;
}

// Adds what a set-up's readings tell, at the last linearisation, the set-up eliminated. `usual`: it is not farther out
// than is usual for such a thing. GaussNewton::assume_usual says so only of unknowns that the readings leave open, but
// which these are depends on the other lines, and where they are known this adds hardly anything.
void add_line(const NormalEquations& equations, int number, const std::vector<int>& common, bool usual,
              Equations& sum) {
    const AdjustmentProblem& problem = equations.problem();
    const LineSetup& setup = problem.setups()[number];
    const Index own = Index(setup.active.size());
    MatrixXd coupled = MatrixXd::Zero(sum.matrix.rows(), own), alone = MatrixXd::Zero(own, own);
    std::map<int, Index> place;  // of the set-up's unknowns
    for (const int column : setup.active) {
        const Index i = Index(place.size());
        place[setup.unknown[column]] = i;
        alone(i, i) = equations.prior_weight()[setup.unknown[column]];
        if (usual) alone(i, i) += std::pow(problem.usual()[setup.unknown[column]], -2);
    }
    VectorXd by_own(own);
    for (const AdjustedPoint& point : problem.points()) {
        if (point.setup != number) continue;
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const NormalEquations::Row row = equations.row(point, r);
            by_own.setZero();
            std::vector<std::pair<int, double>> of_machine;
            for (int i = 0; i < row.size; ++i) {
                if (row.unknown[i] == no_unknown) continue;
                if (const int u = common[row.unknown[i]]; u != no_unknown)
                    of_machine.emplace_back(u, row.derivative[i]);
                else by_own[place.at(row.unknown[i])] = row.derivative[i];
            }
            alone += by_own * by_own.transpose();
            for (const auto& [i, a] : of_machine) {
                coupled.row(i) += a * by_own.transpose();
                sum.diagonal[i] += a * a;
                for (const auto& [j, b] : of_machine) sum.matrix(i, j) += a * b;
            }
        }
    }
    if (own > 0) sum.matrix -= coupled * alone.ldlt().solve(coupled.transpose());
}

}  // namespace

struct LineInformation::State {
    AdjustmentProblem problem;  // of the first run, whose unknowns count
    AdjustmentTables tables;
    Index size;                                                   // the machine's unknowns are the first ones
    std::vector<int> unknowns;                                    // of these places, those that are an unknown
    std::map<std::pair<std::string, bool>, LineEquations> lines;  // by name, and whether it is a scale line
    Grid grid;
    std::vector<std::vector<ChosenLine>> complete;  // lines that determine everything, as all others with them do

    State(AdjustmentProblem first, int positions);
    void add(const AdjustmentProblem& run);

    Equations sum(const std::vector<ChosenLine>& chosen, Equations LineEquations::* which) const;
    // Without a zero: set-ups couple all nodes of their lines.
    BorderedBand band(const MatrixXd& matrix) const { return dense_band(matrix, int(size) - 6 * problem.blocks()); }
    // By the machine's unknowns. `marked`: also its forms.
    std::vector<bool> find_determined(const Equations& at_zero, AdjustmentTables& marked) const;
    VectorXd variances_on_grid(const BorderedBand& inverse, const std::vector<bool>& determined) const;
};

LineInformation::State::State(AdjustmentProblem first, int positions)
    : problem(std::move(first)), tables(problem), grid(problem, positions) {
    size = 6 * problem.blocks();
    for (const AxisNode& node : problem.nodes())
        for (const int unknown : node.unknown)
            if (unknown != no_unknown) {
                unknowns.push_back(unknown);
                size = std::max(size, Index(unknown) + 1);
            }
    std::sort(unknowns.begin(), unknowns.end());
}

void LineInformation::State::add(const AdjustmentProblem& run) {
    const std::vector<int> common = common_unknowns(run, problem);
    Solution solution(run, {});
    if (!solution.solve_from_zero()) refuse_unsolved();
    NormalEquations equations(run);
    decltype(lines) added;
    for (const bool zero : {true, false}) {
        equations.linearise(zero ? VectorXd::Zero(run.size()) : solution.x());
        if (zero) equations.drop_roundings();
        for (int number = 0; number < int(run.setups().size()); ++number) {
            const LineSetup& setup = run.setups()[number];
            LineEquations& line = added
                                      .try_emplace(std::pair(setup.line.name(), setup.is_scale_line),
                                                   LineEquations{Equations(size), Equations(size)})
                                      .first->second;
            add_line(equations, number, common, !zero, zero ? line.at_zero : line.at_machine);
        }
    }
    lines.merge(added);
}

Grid::Grid(const AdjustmentProblem& problem, int grid) {
    if (grid < 2) throw InvalidArgument("grid: expected at least 2 positions an axis");
    const int steps = problem.plan().steps();
    const auto position = [&](Axis axis, int i) { return problem.plan().volume()[index(axis)] * i / (grid - 1); };
    for (const Axis axis : all_axes)
        for (int i = 0; i < grid; ++i) {
            const double along = double(steps) * i / (grid - 1);
            const int low = std::min(int(along), steps - 1);
            AxisPlace at{{low + 1 - along, along - low}, {}, true};
            for (int side = 0; side < 2; ++side) {
                const AxisNode* node = problem.find(axis, low + side, false);
                if (node) at.unknown[side] = node->unknown;
                else at.unknown[side].fill(no_unknown);
                const bool is_home = low + side == 0;
                at.is_visited = at.is_visited && (node || is_home || at.share[side] == 0.0);
            }
            places.push_back(at);
        }
    for (int i = 0; i < grid * grid * grid; ++i) {
        const std::array<int, 3> at{i / (grid * grid), i / grid % grid, i % grid};
        GridPoint point;
        MachineErrors errors;
        Vector3d commanded;
        for (int a = 0; a < 3; ++a) {
            point.place[a] = a * grid + at[a];
            commanded[a] = position(Axis(a), at[a]);
            errors[a].setZero();
        }
        const PoseDerivative pose = differentiate_pose(problem.chain(), problem.tool(), commanded, errors);
        for (int a = 0; a < 3; ++a) {
            point.by_errors.middleCols<3>(6 * a) = pose.shift[a];
            for (int c = 0; c < 3; ++c)
                point.by_errors.col(6 * a + 3 + c) = Vector3d(pose.turn[a].col(c)).cross(pose.lever[a]);
        }
        points.push_back(point);
    }
}

Equations LineInformation::State::sum(const std::vector<ChosenLine>& chosen, Equations LineEquations::* which) const {
    Equations sum(size);
    for (const ChosenLine& line : chosen) {
        const auto found = lines.find({line.name, line.is_scale_line});
        if (found == lines.end())
            throw InvalidArgument("lines: no run has the " + std::string(line.is_scale_line ? "scale line" : "line") +
                                  " \"" + line.name + "\"");
        sum.add(found->second.*which);
    }
    return sum;
}

std::vector<bool> LineInformation::State::find_determined(const Equations& at_zero, AdjustmentTables& marked) const {
    BorderedBand matrix = band(at_zero.matrix);
    for (const int u : unknowns)
        if (at_zero.matrix(u, u) <= left_by_set_up * at_zero.diagonal[u]) element(matrix, u, u) = 0.0;
    const BorderedFactor factor(matrix, rank_threshold);
    std::vector<bool> determined(std::size_t(size), true);
    const VectorXd units = units_of_columns(at_zero.diagonal.cwiseSqrt());
    for (const int held : factor.held()) {
        if (!std::binary_search(unknowns.begin(), unknowns.end(), held)) continue;
        VectorXd vector = VectorXd::Unit(size, held);
        for (int round = 0; round < 2; ++round) {  // as GaussNewton::null_vectors
            VectorXd image = at_zero.matrix.selfadjointView<Eigen::Lower>() * vector;
            factor.solve(image);
            vector -= image;
        }
        mark_touched(vector, units, marked.all(), determined);
    }
    return determined;
}

VectorXd LineInformation::State::variances_on_grid(const BorderedBand& inverse,
                                                   const std::vector<bool>& determined) const {
    return grid.variances(determined, [&](std::size_t at, std::size_t with) {
        const AxisPlace &one = grid.places[at], &other = grid.places[with];
        ErrorCovariance block = ErrorCovariance::Zero();
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j)
                if (const double share = one.share[i] * other.share[j]; share > 0.0)
                    for (int r = 0; r < 6; ++r)
                        for (int c = 0; c < 6; ++c)
                            if (one.unknown[i][r] != no_unknown && other.unknown[j][c] != no_unknown)
                                block(r, c) += share * element(inverse, one.unknown[i][r], other.unknown[j][c]);
        return block;
    });
}

VectorXd Grid::variances(const std::vector<bool>& determined,
                         const std::function<ErrorCovariance(std::size_t, std::size_t)>& covariance) const {
    const std::size_t grid = places.size() / 3;                          // positions of an axis
    std::vector<ErrorCovariance> blocks(places.size() * places.size());  // of places that some point has both of
    std::vector<std::array<bool, 6>> open(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        for (std::size_t j = 0; j <= i; ++j)
            if (i == j || i / grid != j / grid) blocks[i * places.size() + j] = covariance(i, j);
        for (int c = 0; c < 6; ++c) {
            open[i][c] = !places[i].is_visited;
            for (int side = 0; side < 2; ++side)
                if (const int u = places[i].unknown[side][c]; u != no_unknown && places[i].share[side] > 0.0)
                    open[i][c] = open[i][c] || !determined[u];
        }
    }
    VectorXd variances(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
        const GridPoint& point = points[p];
        double variance = 0.0;
        for (int a = 0; a < 3; ++a) {
            const auto by_a = point.by_errors.middleCols<6>(6 * a);
            for (int c = 0; c < 6; ++c)
                if (open[point.place[a]][c] && by_a.col(c).norm() > moves) variance = not_known;
            for (int b = 0; b <= a; ++b) {
                const ErrorCovariance& block = blocks[std::size_t(point.place[a]) * places.size() + point.place[b]];
                const auto by_b = point.by_errors.middleCols<6>(6 * b);
                variance += (a == b ? 1.0 : 2.0) * (by_a * block).cwiseProduct(by_b).sum();
            }
        }
        variances[Index(p)] = variance;
    }
    return variances;
}

LineInformation::LineInformation(const Measurement& run, const Plan& plan, const Chain& chain, const Vector3d& tool,
                                 const HeadCalibrations& heads, const AdjustmentOptions& options, int grid) {
    AdjustmentProblem problem = problem_of(run, plan, chain, tool, heads, options);
    state_ = std::make_shared<State>(problem, grid);
    state_->add(problem);
}

void LineInformation::add(const Measurement& run, const Plan& plan, const HeadCalibrations& heads,
                          const AdjustmentOptions& options) {
    if (plan.steps() != state_->problem.plan().steps())
        throw InvalidArgument("lines: expected " + std::to_string(state_->problem.plan().steps()) + " steps, got " +
                              std::to_string(plan.steps()));
    state_->add(problem_of(run, plan, state_->problem.chain(), state_->problem.tool(), heads, options));
}

KnownByLines LineInformation::known_by(const std::vector<ChosenLine>& lines) {
    State& state = *state_;
    AdjustmentTables tables = state.tables;
    std::vector<bool> determined(std::size_t(state.size), true);
    if (std::none_of(state.complete.begin(), state.complete.end(),
                     [&](const auto& some) { return has(lines, some); })) {
        determined = state.find_determined(state.sum(lines, &LineEquations::at_zero), tables);
        if (std::find(determined.begin(), determined.end(), false) == determined.end()) state.complete.push_back(lines);
    }
    const CalibratedForms forms = choose_forms(tables);
    Equations at_machine = state.sum(lines, &LineEquations::at_machine);
    for (const int u : state.unknowns)
        if (!determined[u]) at_machine.matrix(u, u) += std::pow(state.problem.usual()[u], -2);
    const BorderedBand inverse = BorderedFactor(state.band(at_machine.matrix), rank_threshold).selected_inverse();

    KnownByLines known = known_parameters(forms, inverse, state.problem.plan());
    known.volume = state.variances_on_grid(inverse, determined);
    return known;
}

KnownByLines known_by_run(const Measurement& run, const Plan& plan, const Chain& chain, const Vector3d& tool,
                          const HeadCalibrations& heads, const AdjustmentOptions& options, int positions) {
    Solution solution(problem_of(run, plan, chain, tool, heads, options), {});
    if (!solution.problem().has_rotations()) throw InvalidArgument("adjustment: expected rotations to be unknowns");
    if (!solution.solve_from_zero()) refuse_unsolved();
    const AdjustmentProblem& problem = solution.problem();
    const CalibratedForms forms = choose_forms(solution.tables());
    const BorderedBand& inverse = solution.inverse();
    KnownByLines known = known_parameters(forms, inverse, plan);
    if (std::none_of(known.largest.begin(), known.largest.end(), [](double u) { return std::isfinite(u); }))
        throw InvalidArgument("adjustment: nothing can be determined");

    const Grid grid(problem, positions);
    // How all unknowns vary with each error of each place.
    MatrixXd with_errors(problem.size(), 6 * Index(grid.places.size()));
    for (Index first = 0; first < with_errors.cols(); first += BorderedFactor::sides) {
        const Index count = std::min<Index>(BorderedFactor::sides, with_errors.cols() - first);
        BorderedFactor::Sides errors = BorderedFactor::Sides::Zero(problem.size(), BorderedFactor::sides);
        for (Index k = 0; k < count; ++k) {
            const AxisPlace& place = grid.places[std::size_t(first + k) / 6];
            for (int side = 0; side < 2; ++side)
                if (const int u = place.unknown[side][std::size_t(first + k) % 6]; u != no_unknown)
                    errors(u, k) += place.share[side];
        }
        solution.solver().factor().solve(errors);
        with_errors.middleCols(first, count) = errors.leftCols(count);
    }
    known.volume = grid.variances(solution.observability().determined(), [&](std::size_t at, std::size_t with) {
        ErrorCovariance block = ErrorCovariance::Zero();
        const AxisPlace& place = grid.places[at];
        for (int side = 0; side < 2; ++side)
            for (int c = 0; c < 6; ++c)
                if (const int u = place.unknown[side][c]; u != no_unknown)
                    block.row(c) += place.share[side] * with_errors.block<1, 6>(u, 6 * Index(with));
        return block;
    });
    return known;
}

}  // namespace stepdiag
