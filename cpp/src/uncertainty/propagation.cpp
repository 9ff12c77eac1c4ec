#include "stepdiag/uncertainty/propagation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "batch/batch_method.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/uncertainty/derived.hpp"
#include "uncertainty/contributions.hpp"
#include "uncertainty/noise_effects.hpp"

namespace stepdiag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

void check_model(const LinearModel& model) {
    const Index n = Index(model.inputs.size());
    if (model.value.size() != Index(model.outputs.size()))
        throw InvalidArgument("value: expected " + std::to_string(model.outputs.size()) + " numbers, got " +
                              std::to_string(model.value.size()));
    if (model.sensitivity.rows() != model.value.size() || model.sensitivity.cols() != n)
        throw InvalidArgument("sensitivity: expected " + std::to_string(model.value.size()) + " x " +
                              std::to_string(n) + " numbers, a row each output, got " +
                              std::to_string(model.sensitivity.rows()) + " x " +
                              std::to_string(model.sensitivity.cols()));
    if (!model.sensitivity.allFinite() || !model.value.allFinite())
        throw InvalidArgument("value, sensitivity: expected finite numbers");
    std::map<int, double> estimates;
    for (const PropagatedInput& input : model.inputs) {
        if (!(std::isfinite(input.standard_uncertainty) && input.standard_uncertainty >= 0.0))
            throw InvalidArgument(input.name + ": expected a standard uncertainty of 0 or more");
        if (!(input.degrees_of_freedom > 0.0))
            throw InvalidArgument(input.name + ": expected degrees of freedom above 0");
        if (input.estimate < 0) continue;
        const auto [entry, is_new] = estimates.emplace(input.estimate, input.degrees_of_freedom);
        if (!is_new && entry->second != input.degrees_of_freedom)
            throw InvalidArgument(input.name +
                                  ": expected the same degrees of freedom as for the other inputs of its estimate");
    }
    if (model.correlation.size() > 0) check_correlation(model.correlation, n, "correlation");
}

}  // namespace

Propagation propagate(const LinearModel& model, bool full_covariance) {
    check_model(model);
    VectorXd uncertainty(Index(model.inputs.size()));
    for (Index i = 0; i < uncertainty.size(); ++i) uncertainty[i] = model.inputs[std::size_t(i)].standard_uncertainty;
    const MatrixXd first_order = model.sensitivity * uncertainty.asDiagonal();
    Contributions sum(model.outputs, model.value, full_covariance);
    sum.add_inputs(model.inputs, first_order, MatrixXd::Zero(first_order.rows(), first_order.cols()),
                   model.correlation);
    return sum.result();
}

VectorXd Propagation::expanded(double coverage) const {
    if (!(coverage > 0.0 && coverage < 1.0))
        throw InvalidArgument("coverage: expected a probability between 0 and 1, got " + std::to_string(coverage));
    VectorXd expanded(value.size());
    for (Index i = 0; i < value.size(); ++i) {
        const double nu = degrees_of_freedom[i];
        // The tolerance keeps rounding from truncating 9 to 8.
        const double whole = std::isfinite(nu) ? std::max(std::floor(nu * (1.0 + 1e-12)), std::min(nu, 1.0)) : nu;
        expanded[i] = std::isnan(nu) ? nu : t_quantile((1.0 + coverage) / 2.0, whole) * standard_uncertainty[i];
    }
    return expanded;
}

VectorXd Propagation::second_order_shift() const {
    const VectorXd shift = second_order.rowwise().sum();
    return knows_products ? VectorXd(shift + product_shift) : shift;
}

VectorXd Propagation::second_order_uncertainty() const {
    VectorXd variance = standard_uncertainty.cwiseAbs2() + 2.0 * second_order.rowwise().squaredNorm();
    if (knows_products) variance += product_variance;
    return variance.cwiseSqrt();
}

// --- propagation with virtual calibrations ---

namespace {

constexpr Index largest_gain = 400'000'000;  // numbers: 3.2 GB

// GUM 4.2.3: s/sqrt(n) of n repeated readings with n - 1 degrees of freedom. JCGM 101 uses a t distribution instead.
double gum_uncertainty(const Distribution& d) {
    return d.kind == DistributionKind::student_t ? d.spread : d.standard_uncertainty();
}

// Appends rows for the derived outputs to the rows of the entries.
MatrixXd with_derived(const MatrixXd& of_entries, const std::vector<DerivedOutput>& derived) {
    MatrixXd all(of_entries.rows() + Index(derived.size()), of_entries.cols());
    all.topRows(of_entries.rows()) = of_entries;
    for (std::size_t d = 0; d < derived.size(); ++d)
        all.row(of_entries.rows() + Index(d)) = derived[d].row.transpose() * of_entries;
    return all;
}

MatrixXd correlation_of(const UncertainInputs& inputs) {
    if (inputs.correlations.empty()) return {};
    const Index count = Index(inputs.inputs.size());
    MatrixXd correlation = MatrixXd::Identity(count, count);
    for (const CorrelatedInputs& together : inputs.correlations)
        for (std::size_t i = 0; i < together.members.size(); ++i)
            for (std::size_t j = 0; j < together.members.size(); ++j)
                correlation(together.members[i], together.members[j]) = together.correlation(Index(i), Index(j));
    return correlation;
}

// Results for each input at its expectation, and at its expectation plus and minus its standard uncertainty.
struct InputEffects {
    std::vector<PropagatedInput> inputs;
    VectorXd value;  // at the expectations
    MatrixXd first_order, second_order;
};

InputEffects input_effects(const VirtualCalibrations& calibrations) {
    const auto& uncertain = calibrations.run().inputs.inputs;
    const Index count = Index(uncertain.size());
    MatrixXd deviations(count, 2 * count + 1);
    for (Index i = 0; i < count; ++i) deviations.row(i).setConstant(uncertain[std::size_t(i)].distribution.expectation);
    InputEffects effects;
    for (Index i = 0; i < count; ++i) {
        const UncertainInput& input = uncertain[std::size_t(i)];
        const Distribution& d = input.distribution;
        const double u = gum_uncertainty(d);
        deviations(i, 1 + 2 * i) += u;
        deviations(i, 2 + 2 * i) -= u;
        effects.inputs.push_back({name(input), budget_group(input), u, d.degrees_of_freedom, -1, d.kind});
    }
    const MatrixXd outputs = calibrations.evaluate_at(deviations);
    effects.value = outputs.col(0);
    effects.first_order.resize(outputs.rows(), count);
    effects.second_order.resize(outputs.rows(), count);
    if (!effects.value.allFinite())
        throw InvalidArgument("virtual calibrations: the evaluation has no result without deviations");
    for (Index i = 0; i < count; ++i) {
        const auto up = outputs.col(1 + 2 * i), down = outputs.col(2 + 2 * i);
        if (!up.allFinite() || !down.allFinite())
            throw InvalidArgument(effects.inputs[std::size_t(i)].name +
                                  ": the evaluation has no result for a deviation by its standard uncertainty");
        effects.first_order.col(i) = (up - down) / 2.0;
        effects.second_order.col(i) = (up - effects.value + (down - effects.value)) / 2.0;
    }
    return effects;
}

// d_ij = (f(+i, +j) + f(-i, -j) - 2 f)/2 - s_i - s_j, where s_i is the second order of input i. Odd orders cancel.
void add_products(const VirtualCalibrations& calibrations, const InputEffects& effects, const MatrixXd& correlation,
                  Propagation& result) {
    const auto& uncertain = calibrations.run().inputs.inputs;
    const Index count = Index(uncertain.size());
    if (count > largest_product_inputs) return;
    result.knows_products = true;
    result.strongest_product.assign(std::size_t(effects.value.size()), {});
    result.product_variance = result.product_shift = VectorXd::Zero(effects.value.size());
    VectorXd expectation(count);
    for (Index i = 0; i < count; ++i) expectation[i] = uncertain[std::size_t(i)].distribution.expectation;
    for (Index i = 0; i + 1 < count; ++i) {
        const Index others = count - 1 - i;
        MatrixXd deviations = expectation.replicate(1, 2 * others);
        for (Index k = 0; k < others; ++k)
            for (const int side : {0, 1})
                for (const Index input : {i, i + 1 + k})
                    deviations(input, 2 * k + side) +=
                        (side == 0 ? 1.0 : -1.0) * effects.inputs[std::size_t(input)].standard_uncertainty;
        const MatrixXd outputs = calibrations.evaluate_at(deviations);
        for (Index k = 0; k < others; ++k) {
            const Index j = i + 1 + k;
            const VectorXd product =
                (outputs.col(2 * k) - effects.value + (outputs.col(2 * k + 1) - effects.value)) / 2.0 -
                effects.second_order.col(i) - effects.second_order.col(j);
            result.product_variance += product.cwiseAbs2();
            if (correlation.size() > 0) result.product_shift += correlation(i, j) * product;
            for (Index o = 0; o < product.size(); ++o)
                if (auto& strongest = result.strongest_product[std::size_t(o)];
                    std::abs(product[o]) > std::abs(strongest.value))
                    strongest = {i, j, product[o]};
        }
    }
    // The products are unknown if the evaluation has no result for a pair.
    result.knows_products = result.product_variance.allFinite();
}

MatrixXd gain_of(const VirtualCalibrations& calibrations) {
    const Index entries = Index(calibrations.evaluator().entries().size());
    const Index channels = Index(signal_channels(calibrations.nominal()).size());
    if (entries * channels > largest_gain / std::max<Index>(Index(calibrations.nominal().size()), 1))
        throw InvalidArgument("propagation: expected at most " + std::to_string(largest_gain) +
                              " sensitivities to readings, got more: the plan has too many steps; the Monte Carlo "
                              "method does not need them");
    return with_derived(calibrations.evaluator().gain(), calibrations.derived());
}

}  // namespace

Propagation propagate(const VirtualCalibrations& calibrations, bool full_covariance) {
    const UncertainInputs& uncertain = calibrations.run().inputs;
    InputEffects effects = input_effects(calibrations);
    struct Part {
        std::string group;
        MatrixXd effect;
        double degrees_of_freedom;
    };
    VectorXd value = effects.value;
    std::vector<Part> parts;
    const VectorXd by_sensors = sensor_noise(calibrations.run());
    if (!uncertain.noise.empty() || by_sensors.size() > 0) {
        const NoiseEffects noises(calibrations, gain_of(calibrations));
        for (const ReadingNoise& noise : uncertain.noise) {
            MatrixXd effect = noises.of(noise);
            value += effect.rowwise().sum() * noise.distribution.expectation;
            effect *= gum_uncertainty(noise.distribution);
            parts.push_back({budget_group(noise), std::move(effect), noise.distribution.degrees_of_freedom});
        }
        if (by_sensors.size() > 0)
            parts.push_back(
                {"noise of sensors", noises.gain() * by_sensors.asDiagonal(), std::numeric_limits<double>::infinity()});
    }
    Contributions sum(calibrations.outputs(), value, full_covariance);
    for (const Part& part : parts) sum.add(part.group, part.effect, part.degrees_of_freedom);
    const MatrixXd correlation = correlation_of(uncertain);
    sum.add_inputs(effects.inputs, effects.first_order, effects.second_order, correlation);
    Propagation result = sum.result();
    add_products(calibrations, effects, correlation, result);
    return result;
}

Propagation propagate(const Calibration& calibration, const VirtualCalibrations& calibrations, bool full_covariance) {
    const auto entries = calibration_entries(calibration);
    const auto& expected = calibrations.evaluator().entries();
    const auto same = [](const CalibrationEntry& a, const CalibrationEntry& b) {
        return a.parameter == b.parameter && (std::isnan(a.position) || std::abs(a.position - b.position) <= 1e-6);
    };
    if (entries.size() != expected.size() || !std::equal(entries.begin(), entries.end(), expected.begin(), same))
        throw InvalidArgument("calibration: expected the parameters and nodes of the virtual calibrations (" +
                              std::to_string(expected.size()) + " values), got others (" +
                              std::to_string(entries.size()) + ")");
    if (calibration.covariance.size() == 0)
        throw InvalidArgument("calibration: expected one evaluated with full covariance");
    const MatrixXd rows =
        with_derived(MatrixXd::Identity(Index(entries.size()), Index(entries.size())), calibrations.derived());
    const InputEffects effects = input_effects(calibrations);
    Contributions sum(calibrations.outputs(), rows * calibration_values(calibration), full_covariance);
    sum.add_covariance("readings", rows * calibration.covariance * rows.transpose());
    const MatrixXd correlation = correlation_of(calibrations.run().inputs);
    sum.add_inputs(effects.inputs, effects.first_order, effects.second_order, correlation);
    Propagation result = sum.result();
    add_products(calibrations, effects, correlation, result);
    return result;
}

}  // namespace stepdiag
