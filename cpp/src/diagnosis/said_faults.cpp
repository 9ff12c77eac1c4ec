#include "diagnosis/said_faults.hpp"

#include <algorithm>
#include <limits>

namespace stepdiag {
namespace {

// Each value of a calibration, with the parameter and the limit of what is plausible.
struct Value {
    const LinearForm* form;
    std::string parameter;
    double limit;
};

std::vector<Value> values_of(const CalibratedForms& forms, const Plan& plan, const PlausibleLimits& limits) {
    std::vector<Value> values;
    for (int i = 0; i < function_count; ++i) {
        if (!forms.functions[i]) continue;
        const FunctionId id = FunctionId::at(i);
        double limit = id.is_rotation() ? limits.rotation : limits.translation;
        if (id.is_positioning()) limit = std::min(limit, limits.positioning * plan.volume()[index(id.axis)]);
        for (const LinearForm& form : forms.functions[i]->value) values.push_back({&form, id.name(), limit});
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& form = forms.squarenesses[static_cast<int>(s)])
            values.push_back({&*form, name(s), limits.rotation});
    return values;
}

// Of several alternatives: the value that what each has done makes differ most.
void compare(const std::vector<FaultCandidate>& members, const TestedFaults& rest, const std::vector<Value>& values,
             FaultClass& entry) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::vector<Eigen::VectorXd> effects;
    for (const FaultCandidate& member : members)
        if (!member.is_name) effects.push_back(member.score.size * rest.tests->effect(member.hypothesis));
    for (const Value& value : values) {
        double low = infinity, high = -infinity;
        for (const Eigen::VectorXd& effect : effects) {
            low = std::min(low, value.form->value(effect));
            high = std::max(high, value.form->value(effect));
        }
        if (entry.widest.empty() || (high - low) / value.limit > entry.spread / entry.plausible) {
            entry.widest = value.parameter;
            entry.spread = high - low;
            entry.plausible = value.limit;
        }
    }
}

}  // namespace

std::vector<FaultClass> said_faults(const FaultContext& context, const FaultState& state, const CalibratedForms& forms,
                                    const Measurement& measurement) {
    const AdjustmentProblem& problem = context.problem;
    const auto said = [&](const FoundFault& found, FaultTreatment treatment) {
        FaultClass entry{{}, treatment};
        for (const FaultCandidate& member : found.members) {
            const AdjustedReading& reading =
                problem.readings()[*context.hypotheses.readings(member.hypothesis).begin()];
            const Station& station = measurement.stations()[reading.row];
            entry.members.push_back({member.hypothesis.kind, reading.row, station.run, station.line.name(),
                                     station.point, problem.channel_name(reading), member.score.size,
                                     member.score.standard_uncertainty, member.score.gain});
        }
        return entry;
    };
    const auto has_reading = [](const FaultClass& entry) {
        return std::any_of(entry.members.begin(), entry.members.end(),
                           [](const Fault& fault) { return fault.kind == FaultKind::reading; });
    };
    const std::vector<Value> values = values_of(forms, problem.plan(), context.options.plausible);
    std::vector<FaultClass> classes;
    for (int k = 0; k < int(state.found.size()); ++k) {
        const FoundFault& found = state.found[k];
        const bool left_out = found.handling == FaultHandling::left_out;
        FaultClass entry = said(found, left_out ? FaultTreatment::left_out : FaultTreatment::estimated);
        entry.corrected = context.options.slips == Slips::estimate || has_reading(entry);
        if (!left_out && found.alternatives() > 1)
            compare(found.members, context.test_near(without(state.found, k), *state.solution), values, entry);
        classes.push_back(std::move(entry));
    }
    // Several slips that are not distinguished may be other pairs than these: no class says so.
    const auto is_doubtful = [&](const FaultClass& entry) { return !entry.is_distinguished() && !has_reading(entry); };
    if (std::count_if(classes.begin(), classes.end(), is_doubtful) > 1)
        for (FaultClass& entry : classes)
            if (is_doubtful(entry)) entry.corrected = false;
    if (!state.found.empty() && context.are_too_many(state.found))  // where nothing else is at hand
        for (FaultClass& entry : classes) entry.corrected = false;
    if (state.left) classes.push_back(said(*state.left, FaultTreatment::none));
    return classes;
}

}  // namespace stepdiag
