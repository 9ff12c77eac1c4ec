#include "evaluation/step_systems.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace stepdiag {
namespace {

using Equations = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Most intervals have the same equations as the one before, and these are solved once. Weights that differ by less than
// 0.01 % count as equal: that changes an estimate by less than this part of its uncertainty.
class StepSolver {
public:
    std::shared_ptr<const LeastSquares> solve(const Equations& equations, const Eigen::VectorXd& uncertainty) {
        const bool repeated = last_ && equations.rows() == equations_.rows() && equations == equations_ &&
                              ((uncertainty - uncertainty_).array().abs() <= 1e-4 * uncertainty_.array()).all();
        if (!repeated) {
            equations_ = equations;
            uncertainty_ = uncertainty;
            last_ = std::make_shared<const LeastSquares>(solve_least_squares(equations, uncertainty));
        }
        return last_;
    }

private:
    Equations equations_;
    Eigen::VectorXd uncertainty_;
    std::shared_ptr<const LeastSquares> last_;
};

// What readings tell about the three components of an interval.
struct Kind {
    int first_column;   // of machine_R_line: local x and y for tilts, z for lengths
    int rows_per_step;  // equations of a step
    int first_channel;  // in a reading
    Component first_component;
    OpenReason lack;
    Remedy more_lines;
};
constexpr Kind angles{0, 2, 1, Component::A, OpenReason::few_tilts, Remedy::two_directions},
    lengths{2, 1, 0, Component::X, OpenReason::few_lengths, Remedy::three_directions};

Equations equations_of(const std::vector<Step>& steps, const std::vector<Pass>& passes, const Kind& kind) {
    Equations equations(kind.rows_per_step * steps.size(), 3);
    for (std::size_t s = 0; s < steps.size(); ++s)
        for (int r = 0; r < kind.rows_per_step; ++r)
            equations.row(kind.rows_per_step * s + r) =
                passes[steps[s].pass].frame.col(kind.first_column + r).transpose();
    return equations;
}

// One interval's component along a direction, as a sum of readings; empty if the readings do not determine it.
std::optional<ReadingSum> solve_along(const StepSystem& interval, const Eigen::RowVector3d& direction,
                                      const std::vector<Pass>& passes, const Kind& kind) {
    constexpr double negligible = 1e-9;
    ReadingSum sum;
    if (interval.is_bridged) {
        for (int c = 0; c < 3; ++c) {
            if (std::abs(direction[c]) < negligible) continue;
            if (!interval.determined[c]) return std::nullopt;
            for (const ReadingTerm& term : interval.bridge[c])
                sum.push_back({term.reading, term.channel, direction[c] * term.coefficient});
        }
        return sum;
    }
    const Eigen::RowVectorXd weights = direction * interval.solution->pseudoinverse;
    if ((weights * equations_of(interval.steps, passes, kind) - direction).norm() > negligible) return std::nullopt;
    for (Eigen::Index row = 0; row < weights.size(); ++row) {
        const Step& step = interval.steps[row / kind.rows_per_step];
        const int reading = passes[step.pass].first_reading + step.point;
        const int channel = kind.first_channel + int(row % kind.rows_per_step);
        sum.push_back({reading, channel, -step.sign * weights[row]});
        sum.push_back({reading + 1, channel, step.sign * weights[row]});
    }
    return sum;
}

// Builds the systems of all three axes, and bridges gaps: intervals that would be determined without lost readings.
class SystemBuilder {
public:
    SystemBuilder(const std::vector<Pass>& passes, const std::array<AxisSteps, 3>& steps, const Plan& plan, Kind kind,
                  std::vector<std::vector<bool>> has_reading)
        : passes_(passes), steps_(steps), plan_(plan), kind_(kind), has_reading_(std::move(has_reading)) {
        for (const Pass& pass : passes) {
            variances_.emplace_back();
            for (const PassPoint& point : pass.points) variances_.back().push_back(point.variance());
        }
    }

    AxisSystems build() {
        for (const Axis axis : all_axes) solve_steps(axis);
        bridge_gaps();
        for (const Axis axis : all_axes) sum_up(axis);
        return std::move(systems_);
    }

private:
    static constexpr std::size_t most_gaps =
        100;  // solved jointly; the time grows with the third power of their number

    struct Gap {
        int axis;
        int interval;
    };
    // An equation for the components of all gaps: coefficients, and the readings on its right-hand side.
    struct Bridge {
        Eigen::RowVectorXd coefficients;
        ReadingSum right;
        double variance;
    };

    void solve_steps(Axis axis) {
        StepSolver solver, complete_solver;
        for (std::size_t i = 0; i < steps_[index(axis)].size(); ++i) {
            StepSystem interval;
            for (const Step& step : steps_[index(axis)][i])
                if (has_reading_[step.pass][step.point] && has_reading_[step.pass][step.point + 1])
                    interval.steps.push_back(step);
            Eigen::VectorXd uncertainty(kind_.rows_per_step * interval.steps.size());
            for (Eigen::Index row = 0; row < uncertainty.size(); ++row)
                uncertainty[row] =
                    std::sqrt(step_variance(interval.steps[row / kind_.rows_per_step], row % kind_.rows_per_step));
            interval.solution = solver.solve(equations_of(interval.steps, passes_, kind_), uncertainty);
            std::copy_n(interval.solution->determined.begin(), 3, interval.determined.begin());
            if (interval.steps.size() < steps_[index(axis)][i].size()) {
                const Equations complete = equations_of(steps_[index(axis)][i], passes_, kind_);
                const auto possible = complete_solver.solve(complete, Eigen::VectorXd::Ones(complete.rows()));
                if (possible->rank > interval.solution->rank) gaps_.push_back({index(axis), int(i)});
            }
            systems_[index(axis)].intervals.push_back(std::move(interval));
        }
    }

    double step_variance(const Step& step, Eigen::Index row) const {
        const auto channel = kind_.first_channel + row;
        return variances_[step.pass][step.point][channel] + variances_[step.pass][step.point + 1][channel];
    }

    // Index of the first unknown of a gap; empty if the interval is no gap.
    std::optional<int> unknown(int axis, int interval) const {
        for (std::size_t g = 0; g < gaps_.size(); ++g)
            if (gaps_[g].axis == axis && gaps_[g].interval == interval) return int(3 * g);
        return std::nullopt;
    }

    void bridge_gaps() {
        if (gaps_.empty() || gaps_.size() > most_gaps) return;
        std::vector<Bridge> bridges;
        for (std::size_t g = 0; g < gaps_.size(); ++g) add_steps_inside(g, bridges);
        for (std::size_t v = 0; v < passes_.size(); ++v) add_reaches_over_lost_points(int(v), bridges);
        Eigen::MatrixXd equations(bridges.size(), 3 * gaps_.size());
        Eigen::VectorXd uncertainty(bridges.size());
        for (std::size_t b = 0; b < bridges.size(); ++b) {
            equations.row(b) = bridges[b].coefficients;
            uncertainty[b] = std::sqrt(bridges[b].variance);
        }
        const LeastSquares solution = solve_least_squares(equations, uncertainty);
        for (std::size_t g = 0; g < gaps_.size(); ++g) {
            StepSystem& interval = systems_[gaps_[g].axis].intervals[gaps_[g].interval];
            interval.is_bridged = true;
            for (int c = 0; c < 3; ++c) {
                interval.determined[c] = solution.determined[3 * g + c];
                interval.bridge[c] = combine(bridges, solution.pseudoinverse.row(3 * g + c));
            }
        }
    }

    // Steps that were read in a gap: too few, but they help.
    void add_steps_inside(std::size_t gap, std::vector<Bridge>& bridges) const {
        const StepSystem& interval = systems_[gaps_[gap].axis].intervals[gaps_[gap].interval];
        const Equations equations = equations_of(interval.steps, passes_, kind_);
        for (Eigen::Index row = 0; row < equations.rows(); ++row) {
            const Step& step = interval.steps[row / kind_.rows_per_step];
            Bridge bridge{
                Eigen::RowVectorXd::Zero(3 * gaps_.size()), {}, step_variance(step, row % kind_.rows_per_step)};
            bridge.coefficients.segment<3>(3 * gap) = equations.row(row);
            add_difference(bridge.right, step.pass, step.point, step.point + 1, int(row % kind_.rows_per_step),
                           step.sign);
            bridges.push_back(std::move(bridge));
        }
    }

    // The change from the last reading before lost points to the first one after them is the sum of the steps between.
    void add_reaches_over_lost_points(int pass, std::vector<Bridge>& bridges) const {
        if (passes_[pass].is_scale_line) return;
        int last = -1;
        for (int k = 0; k < int(passes_[pass].points.size()); ++k) {
            if (!has_reading_[pass][k]) continue;
            if (last >= 0 && k > last + 1)
                for (int r = 0; r < kind_.rows_per_step; ++r) add_reach(pass, last, k, r, bridges);
            last = k;
        }
    }

    void add_reach(int pass, int from, int to, int row, std::vector<Bridge>& bridges) const {
        const auto channel = kind_.first_channel + row;
        Bridge bridge{Eigen::RowVectorXd::Zero(3 * gaps_.size()),
                      {},
                      variances_[pass][from][channel] + variances_[pass][to][channel]};
        add_difference(bridge.right, pass, from, to, row, 1.0);
        for (int k = from; k < to; ++k) {
            const PlanPoint &start = passes_[pass].points[k].plan, &end = passes_[pass].points[k + 1].plan;
            const int axis = index(*end.moved), interval = std::min(start.node[axis], end.node[axis]);
            const double sign = end.node[axis] > start.node[axis] ? 1.0 : -1.0;
            const Eigen::RowVector3d direction = sign * passes_[pass].frame.col(kind_.first_column + row).transpose();
            if (const auto first = unknown(axis, interval)) {
                bridge.coefficients.segment<3>(*first) += direction;
                continue;
            }
            const auto known = solve_along(systems_[axis].intervals[interval], direction, passes_, kind_);
            if (!known) return;
            for (const ReadingTerm& term : *known)
                bridge.right.push_back({term.reading, term.channel, -term.coefficient});
        }
        if (bridge.coefficients.cwiseAbs().maxCoeff() > 0.0) bridges.push_back(std::move(bridge));
    }

    void add_difference(ReadingSum& sum, int pass, int from, int to, int row, double factor) const {
        const int first = passes_[pass].first_reading, channel = kind_.first_channel + row;
        sum.push_back({first + from, channel, -factor});
        sum.push_back({first + to, channel, factor});
    }

    static ReadingSum combine(const std::vector<Bridge>& bridges, const Eigen::RowVectorXd& weights) {
        std::map<std::pair<int, int>, double> sum;
        for (std::size_t b = 0; b < bridges.size(); ++b)
            for (const ReadingTerm& term : bridges[b].right)
                sum[{term.reading, term.channel}] += weights[b] * term.coefficient;
        ReadingSum combined;
        for (const auto& [key, coefficient] : sum)
            if (coefficient != 0.0) combined.push_back({key.first, key.second, coefficient});
        return combined;
    }

    void sum_up(Axis axis) {
        AxisSystem& system = systems_[index(axis)];
        system.determined.fill(true);
        for (std::size_t i = 0; i < system.intervals.size(); ++i)
            for (int c = 0; c < 3; ++c) {
                if (system.intervals[i].determined[c]) continue;
                system.determined[c] = false;
                if (!system.gap) system.gap = gap_at(axis, int(i));
            }
        for (int c = 0; c < 3; ++c)
            if (!system.determined[c])
                system.gap->parameters.push_back(
                    FunctionId{axis, Component(static_cast<int>(kind_.first_component) + c)}.name());
    }

    Undetermined gap_at(Axis axis, int interval) const {
        Undetermined gap{OpenPart::whole, {}, kind_.lack};
        gap.positions = {plan_.node_position(axis, interval), plan_.node_position(axis, interval + 1)};
        gap.step = interval + 1;
        gap.lines_read = int(systems_[index(axis)].intervals[interval].steps.size());
        gap.lines_planned = int(steps_[index(axis)][interval].size());
        gap.remedies = {gap.lines_read < gap.lines_planned ? Remedy::lost_points : kind_.more_lines};
        return gap;
    }

    const std::vector<Pass>& passes_;
    const std::array<AxisSteps, 3>& steps_;
    const Plan& plan_;
    Kind kind_;
    std::vector<std::vector<bool>> has_reading_;  // for each pass and point
    std::vector<std::vector<Eigen::Vector3d>> variances_;
    AxisSystems systems_;
    std::vector<Gap> gaps_;
};

template <class HasReading>
std::vector<std::vector<bool>> map_points(const std::vector<Pass>& passes, HasReading&& has_reading) {
    std::vector<std::vector<bool>> result;
    for (std::size_t v = 0; v < passes.size(); ++v) {
        result.emplace_back();
        for (const PassPoint& point : passes[v].points) result.back().push_back(has_reading(int(v), point));
    }
    return result;
}

}  // namespace

AxisSystems make_angle_systems(const std::vector<Pass>& passes, const std::array<AxisSteps, 3>& steps,
                               const Plan& plan) {
    return SystemBuilder(passes, steps, plan, angles,
                         map_points(passes, [](int, const PassPoint& p) { return p.has_tilt; }))
        .build();
}

AxisSystems make_length_systems(const std::vector<Pass>& passes, const std::array<AxisSteps, 3>& steps,
                                const Plan& plan, const std::vector<bool>& usable) {
    const auto has_length = [&](int pass, const PassPoint& point) { return usable[pass] && point.has_length; };
    return SystemBuilder(passes, steps, plan, lengths, map_points(passes, has_length)).build();
}

std::optional<ReadingSum> solve_length_along(const StepSystem& interval, const Eigen::RowVector3d& direction,
                                             const std::vector<Pass>& passes) {
    return solve_along(interval, direction, passes, lengths);
}

}  // namespace stepdiag
