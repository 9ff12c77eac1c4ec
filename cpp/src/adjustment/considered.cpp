#include "adjustment/considered.hpp"

#include <cmath>

namespace stepdiag {

namespace {

// By what the readings change, in units of their standard uncertainties, where all distances are this part longer.
Eigen::VectorXd longer_distances(const AdjustmentProblem& problem, double part) {
    Eigen::VectorXd change(Eigen::Index(problem.readings().size()));
    for (Eigen::Index r = 0; r < change.size(); ++r) {
        const AdjustedReading& reading = problem.readings()[std::size_t(r)];
        const bool is_distance = problem.channel_name(reading).front() == 'd';
        change[r] = is_distance ? part * reading.value / reading.standard_uncertainty : 0.0;
    }
    return change;
}

// The part of each source in the standard uncertainties, by the order of the covariance.
void state_parts(const std::vector<DeviationEffect>& effects, const CalibratedForms& forms, Calibration& calibration) {
    const std::vector<const LinearForm*> list = forms.in_order();
    const double scaled = calibration.uncertainty_scaled.value_or(1.0);
    for (const auto& [source, is_unknown, effect] : effects) {
        auto& part = calibration.uncertainty_parts[source];
        part.resize(list.size());
        for (std::size_t i = 0; i < list.size(); ++i) {
            const double more = list[i]->value(effect) * (is_unknown ? scaled : 1.0);
            part[i] = std::sqrt(part[i] * part[i] + more * more);
        }
    }
}

}  // namespace

std::vector<DeviationEffect> deviation_effects(const GaussNewton& solver, const AdjustmentOptions& options) {
    const AdjustmentProblem& problem = solver.equations().problem();
    std::vector<DeviationEffect> effects;
    const auto add = [&](UncertaintySource source, bool is_unknown, Eigen::VectorXd gradient) {
        solver.factor().solve(gradient);
        effects.push_back({source, is_unknown, std::move(gradient)});
    };
    if (const auto& known = problem.expansion(); known && known->sensor_uncertainty != 0.0)
        for (const AxisGroup& sensor : problem.sensors())
            add(UncertaintySource::temperature, false,
                solver.equations().gradient_of_shifts([&](const AdjustedPoint& point) -> Eigen::Vector3d {
                    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
                    for (const int a : sensor)
                        shift[a] =
                            known->expansion.coefficient[a] * known->sensor_uncertainty * point.place.from_fixed[a];
                    return shift;
                }));
    for (const CoefficientUnknown& of : problem.coefficients())
        if (!of.of_drift) {  // a prior counts as a reading of its unknown does
            Eigen::VectorXd gradient = Eigen::VectorXd::Zero(problem.size());
            gradient[of.unknown] = 1.0 / of.prior;
            add(UncertaintySource::temperature, true, std::move(gradient));
        }
    for (const auto& [source, part] : {std::pair(UncertaintySource::scale, options.distance_scale_uncertainty),
                                       std::pair(UncertaintySource::air, options.air_index_uncertainty)})
        if (part != 0.0) add(source, false, solver.equations().gradient_of(longer_distances(problem, part)));
    return effects;
}

void add_deviation_effects(const std::vector<DeviationEffect>& effects, const AdjustmentProblem& problem,
                           const CalibratedForms& forms, const Observability& observability, Adjustment& result) {
    Calibration& calibration = result.calibration;
    state_parts(effects, forms, calibration);
    for (const auto& [source, is_unknown, effect] : effects) {
        if (is_unknown) continue;
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
