#include "adjustment/smoothness.hpp"

#include <algorithm>
#include <cmath>

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {
namespace {

using Deviations = std::array<double, function_count>;

struct Validation {
    double score;
    double variance_factor;
    double freedom;
};

Validation validate(GaussNewton& solver, const Eigen::VectorXd& x, const Deviations& deviations) {
    solver.equations().make_smooth(deviations);
    solver.factorize(x);
    const NormalEquations& equations = solver.equations();
    Eigen::VectorXd dx = equations.gradient(x);
    solver.factor().solve(dx);
    const Eigen::VectorXd variances = equations.reading_variances(solver.factor().selected_inverse());
    double square_sum = 0.0, freedom = 0.0;
    int count = 0;
    for (const AdjustedPoint& point : equations.problem().points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            if (!equations.problem().readings()[r].used()) continue;
            square_sum += std::pow(equations.residuals()[r] - equations.row(point, r).product(dx), 2);
            ++count;
        }
    for (const ReadingResidual& residual : reading_residuals(equations, variances))
        if (residual.used()) freedom += residual.redundancy;
    if (!(freedom > 0.0)) return {0.0, 1.0, 0.0};
    // The smoothness has to fit, too: second differences as large as was said.
    double roughness = 0.0;
    const Eigen::VectorXd smoothed = x + dx;
    for (const SmoothRow& row : equations.smooth_rows()) roughness += std::pow(row.value(smoothed), 2);
    const double all = std::max(1.0, double(degrees_of_freedom(solver)));
    return {count * square_sum / (freedom * freedom), (square_sum + roughness) / all, all};
}

// What was found may be smoother than what comes out with it, where curvature is coherent: not below that.
Deviations not_below_own_roughness(GaussNewton& solver, const Eigen::VectorXd& x, Deviations deviations) {
    solver.equations().make_smooth(deviations);
    solver.factorize(x);
    Eigen::VectorXd smoothed = solver.equations().gradient(x);
    solver.factor().solve(smoothed);
    smoothed += x;
    std::array<double, function_count> sum{};
    std::array<int, function_count> count{};
    for (const SmoothRow& row : solver.equations().smooth_rows()) {
        sum[row.function] += std::pow(row.value(smoothed) * deviations[row.function], 2);
        ++count[row.function];
    }
    for (int i = 0; i < function_count; ++i)
        if (count[i] > 0) deviations[i] = std::max(deviations[i], std::sqrt(sum[i] / count[i]));
    return deviations;
}

}  // namespace

std::array<double, function_count> given_deviations(const Smoothness& smoothness) {
    Deviations deviations{};
    for (int i = 0; i < function_count; ++i)
        deviations[i] = FunctionId::at(i).is_rotation() ? smoothness.rotation : smoothness.translation;
    return deviations;
}

std::array<double, function_count> smoothness_at_start(const AdjustmentOptions& options) {
    if (!options.smoothness || options.smoothness->cross_validated) return {};
    return given_deviations(*options.smoothness);
}

std::array<double, function_count> cross_validate(GaussNewton& solver, const Eigen::VectorXd& x,
                                                  const AdjustmentOptions& options) {
    constexpr double least_gain = 1e-4;  // of the score: less is not worth a smoother function
    constexpr double factor = 4.0;
    constexpr int most_sweeps = 4;
    const Deviations limits = given_deviations(*options.smoothness);
    // Second differences far above the readings' uncertainty do nothing, far below it make a straight line.
    Deviations start;
    for (int i = 0; i < function_count; ++i)
        start[i] = 16.0 * (FunctionId::at(i).is_rotation() ? options.uncertainty.tilt : options.uncertainty.distance);

    Deviations best{};
    const Validation rough = validate(solver, x, best);
    double least = rough.score;
    // Cross-validation knows nothing of the readings' uncertainties: what they contradict is too smooth.
    const double limit =
        std::max(1.0, rough.variance_factor) * (1.0 + 2.0 * std::sqrt(2.0 / std::max(1.0, rough.freedom)));
    const auto try_out = [&](const Deviations& candidate) {
        const Validation validation = validate(solver, x, candidate);
        if (!(validation.score < least * (1.0 - least_gain)) || validation.variance_factor > limit) return false;
        least = validation.score;
        best = candidate;
        return true;
    };
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
        bool better = false;
        for (int i = 0; i < function_count; ++i) {
            Deviations candidate = best;
            for (const double smoother : {1.0 / factor, factor}) {
                // On, as long as it helps.
                for (int step = 0; step < 8; ++step) {
                    candidate[i] = best[i] > 0.0 ? best[i] * smoother : start[i];
                    candidate[i] = std::max(candidate[i], limits[i]);
                    if (candidate[i] == best[i] || !try_out(candidate)) break;
                    better = true;
                }
                candidate = best;
            }
            if (best[i] > 0.0) {
                candidate[i] = 0.0;
                better = try_out(candidate) || better;
            }
        }
        if (!better) break;
    }
    best = not_below_own_roughness(solver, x, best);
    solver.equations().make_smooth(best);
    return best;
}

}  // namespace stepdiag
