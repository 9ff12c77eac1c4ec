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
        const auto own = std::lower_bound(interval.steps.begin(), interval.steps.end(), pass,
                                          [](const Step& step, int number) { return step.pass < number; });
        if (own != interval.steps.end() && own->pass == pass) {
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
    std::vector<SlopeSystem::Equation> equations;
    system.unknowns_ = std::size_t(SlopeSystem::laser_angle(int(passes.size()), 0));
    for (std::size_t v = 0; v < passes.size(); ++v)
        for (const Axis axis : all_axes) {
            if (!usable[v] || !passes[v].line.moves(axis)) continue;
            const Sum sum = passes[v].is_scale_line ? sum_of_scale_line(passes[v])
                                                    : sum_over_travel(passes, int(v), lengths[index(axis)]);
            if (sum.empty()) continue;
            SlopeSystem::Equation equation{int(v), {}, 0.0};
            const Eigen::Vector3d direction = passes[v].direction();
            equation.coefficient[SlopeSystem::scale(axis)] = direction[index(axis)];
            for (const Squareness s : all_squarenesses) {
                const SquarenessTerm term = squareness_term(s);
                if (term.axis == axis)
                    equation.coefficient[SlopeSystem::squareness(s)] =
                        term.sign * direction[term.component] * plan.volume()[index(axis)];
            }
            double variance = 0.0;
            system.sums_.emplace_back();
            for (const auto& [reading, coefficient] : sum) {
                const Pass& pass = *pass_of_reading[reading];
                const Eigen::Vector2d lateral = pass.points[reading - pass.first_reading].lateral;
                const int angles = SlopeSystem::laser_angle(int(&pass - passes.data()), 0);
                equation.coefficient[angles] -= coefficient * lateral.y();
                equation.coefficient[angles + 1] += coefficient * lateral.x();
                variance += coefficient * coefficient * variance_of_reading[reading];
                system.sums_.back().push_back({reading, coefficient});
            }
            // Lateral travel that cancels leaves rounding errors, which must not look like a determined angle.
            for (auto& [unknown, coefficient] : equation.coefficient)
                if (unknown >= SlopeSystem::first_laser_angle && std::abs(coefficient) < 1e-9 * plan.volume().norm())
                    coefficient = 0.0;
            equation.standard_uncertainty = std::sqrt(variance);
            equations.push_back(std::move(equation));
        }
    system.solve_equations(equations, passes, plan);
    return system;
}

void SlopeSystem::solve_equations(const std::vector<Equation>& equations, const std::vector<Pass>& passes,
                                  const Plan& plan) {
    Reduced reduced = choose_kept(equations, passes);
    for (std::size_t e = 0; e < equations.size(); ++e) {
        if (reduced.is_eliminated[std::size_t(equations[e].pass)]) continue;
        direct_.push_back(int(e));
        reduced.rows.push_back(row_of(equations[e], reduced));
        reduced.standard_uncertainty.push_back(equations[e].standard_uncertainty);
    }
    // Angles that nothing determines, and which change lengths of their pass.
    const auto note_open = [&](int pass, const Eigen::Vector2d& angles) {
        double largest = 0.0;
        for (const PassPoint& point : passes[std::size_t(pass)].points)
            largest = std::max(largest, std::abs(point.lateral.y() * angles[0] - point.lateral.x() * angles[1]));
        if (largest > 1e-9 * plan.volume().norm()) reduced.open.emplace_back(laser_angle(pass, 0), angles);
    };
    std::vector<bool> has_equations(passes.size(), false);
    for (const Equation& equation : equations) has_equations[std::size_t(equation.pass)] = true;
    for (int pass = 0; pass < int(passes.size()); ++pass)
        for (int k = 0; k < 2 && reduced.is_eliminated[std::size_t(pass)] && !has_equations[std::size_t(pass)]; ++k)
            note_open(pass, Eigen::Vector2d::Unit(k));
    for (std::size_t e = 0, end; e < equations.size(); e = end) {
        const int pass = equations[e].pass;
        for (end = e; end < equations.size() && equations[end].pass == pass;) ++end;
        if (!reduced.is_eliminated[std::size_t(pass)]) continue;
        const Eigen::Matrix2d projector = eliminate_angles(equations, e, end, reduced);
        for (int k = 0; k < 2; ++k)
            if (projector.col(k) != Eigen::Vector2d::Zero()) note_open(pass, projector.col(k));
    }
    solve_kept(reduced);
}

// All unknowns of few passes are solved at once; of many, a pass whose angles only its own equations have loses them.
SlopeSystem::Reduced SlopeSystem::choose_kept(const std::vector<Equation>& equations, const std::vector<Pass>& passes) {
    constexpr std::size_t few = 40;
    Reduced reduced;
    reduced.is_eliminated.assign(passes.size(), passes.size() > few);
    for (const Equation& equation : equations)
        for (const auto& [unknown, coefficient] : equation.coefficient) {
            const int pass = (unknown - first_laser_angle) / 2;
            if (unknown >= first_laser_angle && coefficient != 0.0 && pass != equation.pass)
                reduced.is_eliminated[std::size_t(pass)] = false;
        }
    reduced.place.assign(unknowns_, -1);
    for (int j = 0; j < int(unknowns_); ++j) {
        if (j >= first_laser_angle && reduced.is_eliminated[std::size_t((j - first_laser_angle) / 2)]) continue;
        reduced.place[std::size_t(j)] = int(kept_.size());
        kept_.push_back(j);
    }
    return reduced;
}

Eigen::RowVectorXd SlopeSystem::row_of(const Equation& equation, const Reduced& reduced) const {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(Eigen::Index(kept_.size()));
    for (const auto& [unknown, coefficient] : equation.coefficient)
        if (const int j = reduced.place[std::size_t(unknown)]; j >= 0) row[j] = coefficient;
    return row;
}

// Of the equations first to end, which are one pass's. Returns the projector on the angles that they leave open: a
// column of 0 for an angle that they determine.
Eigen::Matrix2d SlopeSystem::eliminate_angles(const std::vector<Equation>& equations, std::size_t first,
                                              std::size_t end, Reduced& reduced) {
    const Eigen::Index count = Eigen::Index(end - first);
    Eigen::MatrixXd by_angle = Eigen::MatrixXd::Zero(count, 2), by_kept(count, Eigen::Index(kept_.size()));
    Eigen::VectorXd u(count);
    const int first_angle = laser_angle(equations[first].pass, 0);
    for (Eigen::Index i = 0; i < count; ++i) {
        const Equation& equation = equations[first + std::size_t(i)];
        for (int k = 0; k < 2; ++k)
            if (const auto found = equation.coefficient.find(first_angle + k); found != equation.coefficient.end())
                by_angle(i, k) = found->second;
        by_kept.row(i) = row_of(equation, reduced);
        u[i] = equation.standard_uncertainty;
    }
    const LeastSquares angles = solve_least_squares(by_angle, u);
    Eliminated& own = eliminated_.emplace_back();
    own.first_angle = first_angle;
    own.first_equation = int(first);
    own.inverse = angles.pseudoinverse;
    own.by_kept = angles.pseudoinverse * by_kept;
    own.without = angles.contradictions.matrix();
    const Eigen::MatrixXd rest = own.without * by_kept;
    for (Eigen::Index row = 0; row < rest.rows(); ++row) {
        reduced.rows.push_back(rest.row(row));
        // Weights are relative to the pass's best equation, and rows of Q have length 1.
        reduced.standard_uncertainty.push_back(u.minCoeff());
    }
    Eigen::Matrix2d projector = Eigen::Matrix2d::Identity() - angles.pseudoinverse * by_angle;
    for (int k = 0; k < 2; ++k)
        if (angles.determined[std::size_t(k)]) projector.col(k).setZero();
    return projector;
}

void SlopeSystem::solve_kept(const Reduced& reduced) {
    const Eigen::Index kept = Eigen::Index(kept_.size());
    Eigen::MatrixXd matrix(Eigen::Index(reduced.rows.size()), kept);
    for (std::size_t i = 0; i < reduced.rows.size(); ++i) matrix.row(Eigen::Index(i)) = reduced.rows[i];
    const LeastSquares solution = solve_least_squares(
        matrix, Eigen::Map<const Eigen::VectorXd>(reduced.standard_uncertainty.data(),
                                                  Eigen::Index(reduced.standard_uncertainty.size())));
    inverse_ = solution.pseudoinverse;
    contradictions_ = solution.contradictions;
    determined_ = solution.determined;
    const Eigen::MatrixXd projector = Eigen::MatrixXd::Identity(kept, kept) - solution.pseudoinverse * matrix;
    const auto undetermined = std::count(determined_.begin(), determined_.end(), false);
    null_space_.setZero(Eigen::Index(unknowns_), undetermined + Eigen::Index(reduced.open.size()));
    Eigen::Index column = 0;
    for (Eigen::Index j = 0; j < kept; ++j) {
        if (determined_[std::size_t(j)]) continue;
        for (Eigen::Index i = 0; i < kept; ++i) null_space_(kept_[std::size_t(i)], column) = projector(i, j);
        for (const Eliminated& pass : eliminated_)
            null_space_.col(column).segment<2>(pass.first_angle) = -pass.by_kept * projector.col(j);
        ++column;
    }
    for (const auto& [first, angles] : reduced.open) null_space_.col(column++).segment<2>(first) = angles;
}

}  // namespace stepdiag
