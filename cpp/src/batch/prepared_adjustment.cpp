#include "batch/prepared_adjustment.hpp"

#include "adjustment/gauss_newton.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

PreparedAdjustment::PreparedAdjustment(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                       const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                       const AdjustmentOptions& options,
                                       const std::array<double, function_count>& smoothness)
    : problem(measurement, plan, chain, tool, heads, options, Elimination::set_ups_last),  // SimdFactor knows no leaves
      smoothness_at_start(options.smoothness && options.smoothness->cross_validated
                              ? std::array<double, function_count>{}
                              : smoothness),
      smoothness(smoothness),
      solver(problem, smoothness_at_start) {
    AdjustmentTables tables(problem);
    const Observability observability(solver, tables);
    const CalibratedForms chosen = choose_forms(tables);
    for (const LinearForm* form : chosen.in_order()) forms.push_back(*form);
    determined = observability.determined();
    solver.equations().make_smooth(smoothness);
    solver.assume_usual(determined);
    start.setZero(problem.size());
    if (!solve_from_zero(solver, determined, start))
        throw InvalidArgument("adjustment: finds no machine and set-up that explain the readings");
    solver.factorize(start);
}

PreparedAdjustment::PreparedAdjustment(const PreparedAdjustment& other)
    : problem(other.problem),
      smoothness_at_start(other.smoothness_at_start),
      smoothness(other.smoothness),
      solver(problem, smoothness_at_start),
      forms(other.forms),
      determined(other.determined),
      start(other.start) {
    solver.equations().make_smooth(smoothness);
    solver.assume_usual(determined);
    solver.equations().assume_usual(determined, start);
    solver.factorize(start);
}

}  // namespace stepdiag
