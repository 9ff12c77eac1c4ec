#include "stepdiag/adjustment/fit_quality.hpp"

#include <cmath>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/smoothness.hpp"

namespace stepdiag {

std::optional<FitQuality> fit_quality(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options, int most_steps) {
    const AdjustmentProblem problem(measurement, plan, chain, tool, heads, options);
    if (problem.readings().empty()) return std::nullopt;
    GaussNewton solver(problem, smoothness_at_start(options));
    solver.assume_usual(std::vector<bool>(std::size_t(problem.size()), false));
    const double square_sum = solver.least_on_the_way(most_steps);
    if (!std::isfinite(square_sum)) return std::nullopt;
    return FitQuality{square_sum, degrees_of_freedom(solver)};
}

}  // namespace stepdiag
