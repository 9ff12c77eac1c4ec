#include "adjustment/sensor_deviations.hpp"

#include <cmath>

namespace stepdiag {

std::vector<Eigen::VectorXd> sensor_effects(const GaussNewton& solver) {
    const AdjustmentProblem& problem = solver.equations().problem();
    std::vector<Eigen::VectorXd> effects;
    if (!problem.expansion() || problem.expansion()->sensor_uncertainty == 0.0) return effects;
    const KnownExpansion& known = *problem.expansion();
    for (const AxisGroup& sensor : problem.sensors()) {
        Eigen::VectorXd effect =
            solver.equations().gradient_of_shifts([&](const AdjustedPoint& point) -> Eigen::Vector3d {
                Eigen::Vector3d shift = Eigen::Vector3d::Zero();
                for (const int a : sensor)
                    shift[a] = known.expansion.coefficient[a] * known.sensor_uncertainty * point.place.from_fixed[a];
                return shift;
            });
        solver.factor().solve(effect);
        effects.push_back(std::move(effect));
    }
    return effects;
}

void add_sensor_effects(const std::vector<Eigen::VectorXd>& effects, const AdjustmentProblem& problem,
                        const CalibratedForms& forms, const Observability& observability, Adjustment& result) {
    Calibration& calibration = result.calibration;
    for (const Eigen::VectorXd& effect : effects) {
        const auto add = [](double& uncertainty, double more) {
            uncertainty = std::sqrt(uncertainty * uncertainty + more * more);
        };
        for (int i = 0; i < function_count; ++i) {
            if (!forms.functions[i]) continue;
            auto& reversal = calibration.reversal[i];
            for (std::size_t k = 0; k < forms.functions[i]->value.size(); ++k) {
                const double change = forms.functions[i]->value[k].value(effect);
                add(calibration.functions[i]->standard_uncertainty[k], change);
                for (std::size_t r = 0; reversal && r < reversal->position.size(); ++r)  // both directions alike
                    if (reversal->position[r] == forms.functions[i]->position[k])
                        add(reversal->negative_standard_uncertainty[r], change);
            }
        }
        for (int s = 0; s < squareness_count; ++s)
            if (forms.squarenesses[s])
                add(calibration.squarenesses[s]->standard_uncertainty, forms.squarenesses[s]->value(effect));
        if (calibration.covariance.size() > 0) {
            const std::vector<const LinearForm*> list = forms.in_order();
            Eigen::VectorXd column(Eigen::Index(list.size()));
            for (std::size_t i = 0; i < list.size(); ++i) column[Eigen::Index(i)] = list[i]->value(effect);
            calibration.covariance += column * column.transpose();
        }
        for (std::size_t c = 0; c < result.combinations.size(); ++c)
            add(result.combinations[c].standard_uncertainty, observability.combinations()[c].form.value(effect));
        std::size_t next = 0;  // the order of setup_estimates
        for (const LineSetup& setup : problem.setups())
            for (const int column : setup.active) {
                if (!is_adjusted(setup::component(column).quantity)) continue;
                SetupEstimate& estimate = result.setup[next++];
                if (estimate.value) add(estimate.standard_uncertainty, effect[setup.unknown[column]]);
            }
    }
}

}  // namespace stepdiag
