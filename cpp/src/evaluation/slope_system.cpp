#include "evaluation/slope_system.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace stepdiag {
namespace {

// A sum of lengths, by reading.
using Sum = std::map<int, double>;

void add_step(Sum& sum, const std::vector<Pass>& passes, const Step& step) {
    const int from = passes[step.pass].first_reading + step.point;
    sum[from] -= step.sign;
    sum[from + 1] += step.sign;
}

// The sum of a line's increments over the travel of one axis, in the direction of the axis; empty if increments are
// missing.
Sum sum_over_travel(const std::vector<Pass>& passes, int pass, const AxisSystem& axis) {
    Sum sum;
    const Eigen::RowVector3d direction = passes[pass].direction().transpose();
    for (const StepSystem& interval : axis.intervals) {
        const auto own = std::find_if(interval.steps.begin(), interval.steps.end(),
                                      [&](const Step& step) { return step.pass == pass; });
        if (own != interval.steps.end()) {
            add_step(sum, passes, *own);
            continue;
        }
        const auto predicted = solve_length_along(interval, direction, passes);
        if (!predicted) return {};
        for (const ReadingTerm& term : *predicted) sum[term.reading] += term.coefficient;
    }
    return sum;
}

Sum sum_of_scale_line(const Pass& pass) {
    if (!pass.points.front().has_length || !pass.points.back().has_length) return {};
    const auto moved = std::find_if(all_axes.begin(), all_axes.end(), [&](Axis axis) { return pass.line.moves(axis); });
    const double sign = pass.line.sign(*moved);
    return {{pass.first_reading, -sign}, {pass.first_reading + int(pass.points.size()) - 1, sign}};
}

}  // namespace

SlopeSystem make_slope_system(const std::vector<Pass>& passes, const Plan& plan, const AxisSystems& lengths,
                              const std::vector<bool>& usable) {
    std::vector<const Pass*> pass_of_reading;
    std::vector<double> variance_of_reading;
    for (const Pass& pass : passes)
        for (const PassPoint& point : pass.points) {
            pass_of_reading.push_back(&pass);
            variance_of_reading.push_back(point.variance()[0]);
        }

    SlopeSystem system;
    std::vector<Eigen::RowVectorXd> equations;
    std::vector<double> uncertainty;
    const int unknowns = SlopeSystem::laser_angle(int(passes.size()), 0);
    for (std::size_t v = 0; v < passes.size(); ++v)
        for (const Axis axis : all_axes) {
            if (!usable[v] || !passes[v].line.moves(axis)) continue;
            const Sum sum = passes[v].is_scale_line ? sum_of_scale_line(passes[v])
                                                    : sum_over_travel(passes, int(v), lengths[index(axis)]);
            if (sum.empty()) continue;
            Eigen::RowVectorXd equation = Eigen::RowVectorXd::Zero(unknowns);
            const Eigen::Vector3d direction = passes[v].direction();
            equation[SlopeSystem::scale(axis)] = direction[index(axis)];
            for (const Squareness s : all_squarenesses) {
                const SquarenessTerm term = squareness_term(s);
                if (term.axis == axis)
                    equation[SlopeSystem::squareness(s)] =
                        term.sign * direction[term.component] * plan.volume()[index(axis)];
            }
            double variance = 0.0;
            system.sums_.emplace_back();
            for (const auto& [reading, coefficient] : sum) {
                const Pass& pass = *pass_of_reading[reading];
                const Eigen::Vector2d lateral = pass.points[reading - pass.first_reading].lateral;
                const int angles = SlopeSystem::laser_angle(int(&pass - passes.data()), 0);
                equation[angles] -= coefficient * lateral.y();
                equation[angles + 1] += coefficient * lateral.x();
                variance += coefficient * coefficient * variance_of_reading[reading];
                system.sums_.back().push_back({reading, coefficient});
            }
            // Lateral travel that cancels leaves rounding errors, which must not look like a determined angle.
            for (double& coefficient : equation.tail(unknowns - SlopeSystem::first_laser_angle))
                if (std::abs(coefficient) < 1e-9 * plan.volume().norm()) coefficient = 0.0;
            equations.push_back(equation);
            uncertainty.push_back(std::sqrt(variance));
        }

    Eigen::MatrixXd matrix(equations.size(), unknowns);
    for (std::size_t i = 0; i < equations.size(); ++i) matrix.row(Eigen::Index(i)) = equations[i];
    const LeastSquares solution = solve_least_squares(
        matrix, Eigen::Map<const Eigen::VectorXd>(uncertainty.data(), Eigen::Index(uncertainty.size())));
    system.inverse_ = solution.pseudoinverse;
    system.contradictions_ = solution.contradictions;
    system.determined_ = solution.determined;
    const Eigen::MatrixXd projector = Eigen::MatrixXd::Identity(unknowns, unknowns) - solution.pseudoinverse * matrix;
    const auto open = std::count(solution.determined.begin(), solution.determined.end(), false);
    system.null_space_.resize(unknowns, open);
    for (Eigen::Index j = 0, column = 0; j < unknowns; ++j)
        if (!solution.determined[j]) system.null_space_.col(column++) = projector.col(j);
    return system;
}

}  // namespace stepdiag
