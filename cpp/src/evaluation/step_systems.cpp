#include "evaluation/step_systems.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace stepdiag {
namespace {

using Equations = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Most intervals have the same equations as the one before: solved once. Weights that differ by a hundredth of a
// percent count as the same; that moves no estimate by more than that share of its uncertainty.
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

// Rows of machine_R_line^T that a step's readings see, from `first` on.
template <class HasReading>
AxisSystem make_system(const std::vector<Visit>& visits, const AxisSteps& steps, const Plan& plan, Axis axis, int first,
                       int rows_per_step, HasReading&& has_reading) {
    AxisSystem system;
    system.determined.fill(true);
    StepSolver solver;
    std::vector<std::vector<Eigen::Vector3d>> variances(visits.size());
    for (std::size_t v = 0; v < visits.size(); ++v)
        for (const VisitPoint& point : visits[v].points) variances[v].push_back(point.variance());

    for (std::size_t i = 0; i < steps.size(); ++i) {
        StepSystem interval;
        for (const Step& step : steps[i])
            if (has_reading(step.visit, step.point) && has_reading(step.visit, step.point + 1))
                interval.steps.push_back(step);
        Equations equations(rows_per_step * interval.steps.size(), 3);
        Eigen::VectorXd uncertainty(equations.rows());
        Eigen::Index row = 0;
        for (const Step& step : interval.steps)
            for (int r = 0; r < rows_per_step; ++r, ++row) {
                const int channel = rows_per_step == 1 ? 0 : 1 + r;  // length, or alpha and beta
                equations.row(row) = visits[step.visit].frame.col(first + r).transpose();
                uncertainty[row] = std::sqrt(variances[step.visit][step.point][channel] +
                                             variances[step.visit][step.point + 1][channel]);
            }
        interval.solution = solver.solve(equations, uncertainty);
        for (int c = 0; c < 3; ++c) {
            if (interval.solution->determined[c]) continue;
            system.determined[c] = false;
            if (!system.gap.empty()) continue;
            std::ostringstream text;
            text << "step " << i + 1 << " of " << letter(axis) << " (" << plan.node_position(axis, int(i)) << " to "
                 << plan.node_position(axis, int(i) + 1) << " mm) was read on " << interval.steps.size()
                 << (interval.steps.size() == 1 ? " line" : " lines");
            system.gap = text.str();
        }
        system.intervals.push_back(std::move(interval));
    }
    return system;
}

}  // namespace

AxisSystems make_angle_systems(const std::vector<Visit>& visits, const std::array<AxisSteps, 3>& steps,
                               const Plan& plan) {
    const auto has_tilt = [&](int visit, int point) { return visits[visit].points[point].has_tilt; };
    AxisSystems systems;
    for (const Axis axis : all_axes)
        systems[index(axis)] = make_system(visits, steps[index(axis)], plan, axis, 0, 2, has_tilt);
    return systems;
}

AxisSystems make_length_systems(const std::vector<Visit>& visits, const std::array<AxisSteps, 3>& steps,
                                const Plan& plan, const std::vector<bool>& usable) {
    const auto has_length = [&](int visit, int point) {
        return usable[visit] && visits[visit].points[point].has_length;
    };
    AxisSystems systems;
    for (const Axis axis : all_axes)
        systems[index(axis)] = make_system(visits, steps[index(axis)], plan, axis, 2, 1, has_length);
    return systems;
}

}  // namespace stepdiag
