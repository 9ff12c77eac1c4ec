#include "diagnosis/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

double noise_factor(const Adjustment& adjustment) { return std::sqrt(adjustment.variance_factor()); }

// Noise that is larger than stated throughout is a factor with an uncertainty: of a variance of f degrees of freedom it
// is 1/sqrt(2 f) of it.
FitReason noise(FitFinding finding, const Adjustment& adjustment) {
    FitReason reason{finding, noise_factor(adjustment), 1.0};
    reason.standard_uncertainty = reason.value / std::sqrt(2.0 * adjustment.degrees_of_freedom);
    return reason;
}

// Of channels that scatter more than stated, and were weighed with that: those beyond what is credible, or the others.
void take_components(const Adjustment& adjustment, bool beyond, std::vector<FitReason>& reasons) {
    const double most = thresholds.largest_noise_factor;
    for (const VarianceComponent& each : adjustment.variance_components) {
        if (!each.used || (each.noise.factor > most) != beyond) continue;
        FitReason reason{beyond ? FitFinding::noise_factor : FitFinding::misfit, each.noise.factor, beyond ? most : 1.0,
                         each.noise.line, each.noise.channel};
        reason.standard_uncertainty = each.standard_uncertainty;
        reasons.push_back(reason);
    }
}

void compare_with_stated_noise(const Adjustment& adjustment, std::vector<FitReason>& reasons) {
    const double factor = noise_factor(adjustment);
    if (!(factor <= thresholds.largest_noise_factor))
        reasons.push_back({FitFinding::noise_factor, factor, thresholds.largest_noise_factor});
}

void take_patterns(const std::vector<ResidualPattern>& patterns, double limit, std::vector<FitReason>& reasons) {
    for (const ResidualPattern& pattern : patterns)
        if (pattern.probability < limit) reasons.push_back(pattern.reason);
}

void compare_with_priors(const Adjustment& adjustment, std::vector<FitReason>& reasons) {
    for (const SetupEstimate& e : adjustment.setup) {
        if (!e.value || !std::isfinite(e.prior) || e.prior == 0.0) continue;
        const double distance = distance_from_prior(*e.value, e.standard_uncertainty, e.prior);
        if (!(distance <= thresholds.farthest_prior))
            reasons.push_back(
                {FitFinding::prior, distance, thresholds.farthest_prior, e.line, name(e.quantity), e.component});
    }
    for (const FitReason& reason : far_coefficients(adjustment.expansion, adjustment.machine_drift))
        reasons.push_back(reason);
}

void judge_faults(const Adjustment& adjustment, std::vector<FitReason>& reasons) {
    for (std::size_t k = 0; k < adjustment.faults.size(); ++k) {
        const FaultClass& found = adjustment.faults[k];
        const Fault& best = found.members.front();
        FitReason reason{FitFinding::fault, best.chi_square_gain, thresholds.fault, best.line, best.channel};
        reason.fault = int(k) + 1;
        if (!found.corrected) reasons.push_back(reason);
        if (!(found.spread > found.plausible)) continue;
        reason.finding = FitFinding::alternatives;
        reason.parameter = found.widest;
        reason.value = found.spread;
        reason.limit = found.plausible;
        reasons.push_back(reason);
    }
}

}  // namespace

// A value that stands further from its prior than the readings' own uncertainty of it lets chance explain. Five
// standard deviations: of dozens of unknowns in a sound run, one stands beyond four in every 250 runs.
double distance_from_prior(double value, double standard_uncertainty, double prior) {
    constexpr double least_share = 1e-3;  // of the prior: below it the readings say nothing that could contradict it
    const double known = std::max(prior * prior - standard_uncertainty * standard_uncertainty,
                                  least_share * least_share * prior * prior);
    return std::abs(value) / std::sqrt(known);
}

std::vector<FitReason> far_coefficients(const std::vector<ExpansionEstimate>& expansion,
                                        const std::vector<DriftEstimate>& machine_drift) {
    std::vector<FitReason> reasons;
    for (const ExpansionEstimate& e : expansion)
        if (const double distance = distance_from_prior(e.value - e.stated, e.standard_uncertainty, e.prior);
            !(distance <= thresholds.farthest_prior))
            reasons.push_back({FitFinding::prior, distance, thresholds.farthest_prior, "", "expansion",
                               e.axes.size() == 1 ? e.axes.front() : -1});
    for (const DriftEstimate& e : machine_drift)
        if (const double distance = distance_from_prior(e.value, e.standard_uncertainty, e.prior);
            !(distance <= thresholds.farthest_prior))
            reasons.push_back({FitFinding::prior, distance, thresholds.farthest_prior, "", "machine_drift", e.axis});
    return reasons;
}

Verdict judge(const Adjustment& adjustment, const std::vector<ResidualPattern>& patterns,
              const std::vector<ResidualPattern>& prior_scatter, const ResidualPattern& less_noise,
              double residual_rounding) {
    std::vector<FitReason> reasons;
    judge_faults(adjustment, reasons);
    if (reasons.empty() && adjustment.degrees_of_freedom <= 0)
        return {Fit::unchecked, {{FitFinding::no_redundancy, 0.0, 1.0}}};
    const double probability = adjustment.chi_square_probability;
    take_components(adjustment, true, reasons);
    compare_with_stated_noise(adjustment, reasons);
    if (!(probability >= thresholds.misfit_rejected)) take_patterns(patterns, thresholds.pattern, reasons);
    compare_with_priors(adjustment, reasons);
    if (reasons.empty()) take_patterns(prior_scatter, thresholds.prior_scatter_rejected, reasons);
    if (!reasons.empty()) return {Fit::rejected, reasons};
    if (residual_rounding <= thresholds.rounding_alone && noise_factor(adjustment) < thresholds.far_below_stated)
        return {Fit::unchecked, {{FitFinding::no_noise, residual_rounding, thresholds.rounding_alone}}};

    take_components(adjustment, false, reasons);
    if (!(probability >= thresholds.misfit_doubtful)) {
        take_patterns(patterns, thresholds.pattern, reasons);
        reasons.push_back(noise(FitFinding::misfit, adjustment));
    } else {
        take_patterns(patterns, thresholds.pattern_alone, reasons);
        // Where less was stated than can be weighed, less noise than is used says nothing of what was stated.
        if (adjustment.rounded.empty()) take_patterns({less_noise}, 1.0 - thresholds.no_misfit_doubtful, reasons);
    }
    take_patterns(prior_scatter, thresholds.pattern_alone, reasons);
    return {reasons.empty() ? Fit::accepted : Fit::doubtful, reasons};
}

void take_costs(const std::vector<FitReason>& costs, Verdict& verdict) {
    if (costs.empty() || verdict.fit == Fit::unchecked) return;
    if (verdict.fit == Fit::accepted) verdict.fit = Fit::doubtful;
    const bool is_rejected = verdict.fit == Fit::rejected;
    verdict.reasons.insert(is_rejected ? verdict.reasons.end() : verdict.reasons.begin(), costs.begin(), costs.end());
}

Adjustment judge(Adjustment adjustment, const FoundBeside& beside) {
    Verdict& verdict = adjustment.verdict;
    const auto reason = [](FitFinding finding, const std::string& words) {
        FitReason reason{finding, 0.0, 0.0};
        reason.parameter = words;
        return reason;
    };
    const bool is_rejected = verdict.fit == Fit::rejected;
    auto place = is_rejected ? verdict.reasons.end() : verdict.reasons.begin();
    for (const std::string& input : beside.implausible_inputs) {
        if (!is_rejected) verdict.fit = Fit::doubtful;
        place = std::next(verdict.reasons.insert(place, reason(FitFinding::implausible_input, input)));
    }
    if (!beside.mistake.empty()) {
        verdict.fit = Fit::rejected;
        verdict.reasons.insert(verdict.reasons.begin(), reason(FitFinding::mistake, beside.mistake));
    }
    state_verdict(adjustment);
    return adjustment;
}

void state_verdict(Adjustment& adjustment) {
    Calibration& calibration = adjustment.calibration;
    calibration.fit = adjustment.verdict.fit;
    calibration.fit_codes.clear();
    for (const FitReason& reason : adjustment.verdict.reasons)  // alternatives share the sentence of the first
        if (!reason.alternative || calibration.fit_codes.empty()) calibration.fit_codes.push_back(name(reason.finding));
}

void scale_uncertainties(Adjustment& adjustment) {
    const double factor = noise_factor(adjustment);
    const auto& components = adjustment.variance_components;
    if (std::any_of(components.begin(), components.end(), [](const VarianceComponent& each) { return each.used; }))
        return;
    if (adjustment.degrees_of_freedom <= 0 || !(factor > 1.0)) return;
    Calibration& calibration = adjustment.calibration;
    const auto scale = [&](std::vector<double>& all) {
        for (double& u : all) u *= factor;
    };
    for (auto& function : calibration.functions)
        if (function) scale(function->standard_uncertainty);
    for (auto& reversal : calibration.reversal)
        if (reversal) {
            scale(reversal->standard_uncertainty);
            scale(reversal->negative_standard_uncertainty);
        }
    for (auto& squareness : calibration.squarenesses)
        if (squareness) squareness->standard_uncertainty *= factor;
    calibration.covariance *= factor * factor;
    for (SetupEstimate& estimate : adjustment.setup) estimate.standard_uncertainty *= factor;
    for (KnownCombination& combination : adjustment.combinations) combination.standard_uncertainty *= factor;
    for (ExpansionEstimate& estimate : adjustment.expansion) estimate.standard_uncertainty *= factor;
    calibration.uncertainty_scaled = factor;
    Verdict& verdict = adjustment.verdict;
    if (verdict.fit == Fit::accepted) verdict.fit = Fit::doubtful;
    verdict.reasons.push_back(noise(FitFinding::scaled, adjustment));
}

}  // namespace stepdiag
