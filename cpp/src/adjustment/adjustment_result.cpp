#include "adjustment/adjustment_result.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr Eigen::Index largest_covariance = 10'000;  // values a side: 800 MB

int count_determined(const FunctionForms& forms) {
    return int(std::count_if(forms.value.begin(), forms.value.end(),
                             [](const LinearForm& form) { return form.size > 0 && form.determined; }));
}

FunctionForms determined_part(const FunctionForms& forms) {
    FunctionForms part;
    for (std::size_t k = 0; k < forms.value.size(); ++k)
        if (forms.value[k].determined) {
            part.position.push_back(forms.position[k]);
            part.value.push_back(forms.value[k]);
        }
    return part;
}

double uncertainty(const LinearForm& form, const BorderedBand& inverse) {
    return std::sqrt(std::max(0.0, form.variance(inverse)));  // rounding may leave -1e-30 of what is known exactly
}

}  // namespace

std::vector<const LinearForm*> CalibratedForms::in_order() const {
    std::vector<const LinearForm*> forms;
    for (const auto& function : functions)
        if (function)
            for (const LinearForm& form : function->value) forms.push_back(&form);
    for (const auto& squareness : squarenesses)
        if (squareness) forms.push_back(&*squareness);
    return forms;
}

CalibratedForms choose_forms(const AdjustmentTables& tables) {
    CalibratedForms chosen;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const FunctionForms &values = tables.values(id), &shapes = tables.shapes(id);
        // Where its slope is open, a function keeps its shape, unless more of its values are known.
        const int known_values = count_determined(values), known_shapes = count_determined(shapes);
        const auto& slope = tables.slope(id);
        const bool slope_open = !id.is_straightness() && slope && !slope->determined;
        chosen.slope_determined[i] = !slope_open || known_values >= known_shapes;
        const FunctionForms& known = chosen.slope_determined[i] ? values : shapes;
        if (count_determined(known) > 0) chosen.functions[i] = determined_part(known);
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& form = tables.squareness(s); form && form->determined)
            chosen.squarenesses[static_cast<int>(s)] = form;
    return chosen;
}

Calibration make_calibration(const AdjustmentProblem& problem, const AdjustmentTables& tables,
                             const CalibratedForms& forms, const Eigen::VectorXd& x, const BorderedBand& inverse) {
    Calibration calibration{"adjustment", problem.chain(), problem.plan().volume(), problem.tool(), {}, {}};
    for (int i = 0; i < function_count; ++i) {
        if (forms.functions[i]) {
            CalibratedFunction function{forms.functions[i]->position, {}, {}, forms.slope_determined[i]};
            for (const LinearForm& form : forms.functions[i]->value) {
                function.value.push_back(form.value(x));
                function.standard_uncertainty.push_back(uncertainty(form, inverse));
            }
            calibration.functions[i] = std::move(function);
        }
        const FunctionId id = FunctionId::at(i);
        const FunctionForms &whole = tables.reversal(id), &change = tables.reversal_change(id);
        const bool constant = !whole.value.empty() && whole.value.front().determined;
        const FunctionForms& known = constant ? whole : change;
        if (!calibration.functions[i] || count_determined(known) == 0) continue;
        CalibratedReversal reversal{{}, {}, {}, {}, constant};
        const FunctionForms& positive = *forms.functions[i];
        for (std::size_t k = 0; k < known.value.size(); ++k) {
            const auto at = std::find(positive.position.begin(), positive.position.end(), known.position[k]);
            if (!known.value[k].determined || at == positive.position.end()) continue;
            // The - table is function - reversal: a sum of the unknowns of both.
            LinearForm negative = positive.value[std::size_t(at - positive.position.begin())];
            negative.subtract(known.value[k]);
            reversal.position.push_back(known.position[k]);
            reversal.value.push_back(known.value[k].value(x));
            reversal.standard_uncertainty.push_back(uncertainty(known.value[k], inverse));
            reversal.negative_standard_uncertainty.push_back(uncertainty(negative, inverse));
        }
        calibration.reversal[i] = std::move(reversal);
    }
    for (int s = 0; s < squareness_count; ++s)
        if (forms.squarenesses[s])
            calibration.squarenesses[s] =
                CalibratedSquareness{forms.squarenesses[s]->value(x), uncertainty(*forms.squarenesses[s], inverse)};
    return calibration;
}

void add_covariance(const AdjustmentProblem& problem, const CalibratedForms& forms, const BorderedFactor& factor,
                    Calibration& calibration) {
    const std::vector<const LinearForm*> list = forms.in_order();
    const Eigen::Index size = Eigen::Index(list.size());
    if (size > largest_covariance)
        throw InvalidArgument("full_covariance: expected at most " + std::to_string(largest_covariance) +
                              " values, the run gives " + std::to_string(size) + "; the variances need none");
    Eigen::MatrixXd covariance(size, size);
    BorderedFactor::Sides columns(problem.size(), BorderedFactor::sides);
    for (Eigen::Index first = 0; first < size; first += BorderedFactor::sides) {
        const Eigen::Index count = std::min<Eigen::Index>(BorderedFactor::sides, size - first);
        columns.setZero();
        for (Eigen::Index j = 0; j < count; ++j) {
            const LinearForm& form = *list[first + j];
            for (int i = 0; i < form.size; ++i) columns(form.unknown[i], j) += form.coefficient[i];
        }
        factor.solve(columns);
        for (Eigen::Index i = 0; i < size; ++i)
            covariance.row(i).segment(first, count) = list[i]->values(columns).head(count);
    }
    Eigen::VectorXd to_stated(size);  // of each value: its standard uncertainty over that of the solutions
    Eigen::Index next = 0;
    Eigen::VectorXd stated(size);
    const auto take = [&](double u) {
        const double variance = covariance(next, next);
        to_stated[next] = variance > 0.0 ? u / std::sqrt(variance) : 0.0;  // rounding may leave -1e-30 of what is exact
        stated[next++] = u * u;
    };
    for (const auto& function : calibration.functions)
        if (function) std::for_each(function->standard_uncertainty.begin(), function->standard_uncertainty.end(), take);
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) take(squareness->standard_uncertainty);
    calibration.covariance =
        to_stated.asDiagonal() * (0.5 * (covariance + covariance.transpose())) * to_stated.asDiagonal();
    calibration.covariance.diagonal() = stated;
}

std::vector<bool> known_unknowns(const AdjustmentProblem& problem, std::vector<bool> known,
                                 const BorderedBand& inverse) {
    for (const LineSetup& setup : problem.setups())
        for (const int column : setup.active) {
            const int unknown = setup.unknown[column];
            if (setup.prior[column] < record(setup::component(column).quantity).broadest) continue;
            const double u = std::sqrt(element(inverse, unknown, unknown));
            if (u > 0.5 * setup.prior[column]) known[unknown] = false;
        }
    return known;
}

std::vector<SetupEstimate> setup_estimates(const AdjustmentProblem& problem, const std::vector<bool>& known,
                                           const Eigen::VectorXd& x, const BorderedBand& inverse) {
    std::vector<SetupEstimate> estimates;
    for (const LineSetup& setup : problem.setups())
        for (const int column : setup.active) {
            const auto [quantity, component] = setup::component(column);
            if (!is_adjusted(quantity)) continue;  // the cosine error
            SetupEstimate estimate{setup.run, setup.line.name(),  quantity, component, std::nullopt,
                                   0.0,       setup.prior[column]};
            const int unknown = setup.unknown[column];
            if (known[unknown]) {
                estimate.value = x[unknown];
                estimate.standard_uncertainty = std::sqrt(element(inverse, unknown, unknown));
            }
            estimates.push_back(estimate);
        }
    return estimates;
}

std::vector<ExpansionEstimate> expansion_estimates(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                                   const BorderedBand& inverse) {
    std::vector<ExpansionEstimate> estimates;
    for (const CoefficientUnknown& of : problem.coefficients()) {
        if (of.of_drift) continue;
        const double stated = problem.expansion()->expansion.coefficient[of.axes.front()];
        estimates.push_back(
            {of.axes, stated + x[of.unknown], std::sqrt(element(inverse, of.unknown, of.unknown)), stated, of.prior});
    }
    return estimates;
}

std::vector<DriftEstimate> drift_estimates(const AdjustmentProblem& problem, const Eigen::VectorXd& x,
                                           const BorderedBand& inverse) {
    std::vector<DriftEstimate> estimates;
    for (const CoefficientUnknown& of : problem.coefficients())
        if (of.of_drift)
            estimates.push_back(
                {of.axes.front(), x[of.unknown], std::sqrt(element(inverse, of.unknown, of.unknown)), of.prior});
    return estimates;
}

int degrees_of_freedom(const GaussNewton& solver) {
    const AdjustmentProblem& problem = solver.equations().problem();
    int count = int(solver.equations().smooth_rows().size()) - problem.unknowns() + int(solver.dependent().size());
    for (const AdjustedReading& reading : problem.readings()) count += reading.used();
    count += problem.informative_priors();
    return count;
}

std::vector<ReadingResidual> reading_residuals(const NormalEquations& equations, const Eigen::VectorXd& variances) {
    const AdjustmentProblem& problem = equations.problem();
    std::vector<ReadingResidual> residuals;
    residuals.reserve(problem.readings().size());
    for (std::size_t r = 0; r < problem.readings().size(); ++r) {
        const AdjustedReading& reading = problem.readings()[r];
        const double share = variances[r], weighted = equations.residuals()[r];
        ReadingResidual residual{
            reading.row,    problem.channel_name(reading), weighted * reading.standard_uncertainty, 0.0, 0.0,
            reading.outlier};
        residual.redundancy = reading.used() ? std::max(0.0, 1.0 - share) : 1.0 / (1.0 + share);
        if (reading.used() && residual.redundancy < controlled_share) residual.redundancy = 0.0;
        else if (reading.used()) residual.normalised = weighted / std::sqrt(residual.redundancy);
        else residual.normalised = weighted * std::sqrt(residual.redundancy);
        residuals.push_back(residual);
    }
    return residuals;
}

}  // namespace stepdiag
