#include "stepdiag/adjustment/results.hpp"

#include <algorithm>

#include "stepdiag/adjustment/options.hpp"

namespace stepdiag {

std::string name(RoundingCause cause) {
    constexpr const char* names[] = {"doubles", "decimals", "weights"};
    return names[static_cast<int>(cause)];
}

double Adjustment::variance_factor() const {
    return degrees_of_freedom > 0 ? weighted_square_sum / degrees_of_freedom : 1.0;
}

std::vector<std::size_t> Adjustment::outliers() const {
    std::vector<std::size_t> list;
    for (std::size_t r = 0; r < residuals.size(); ++r)
        if (!residuals[r].used()) list.push_back(r);
    std::stable_sort(list.begin(), list.end(),
                     [&](std::size_t i, std::size_t j) { return residuals[i].outlier < residuals[j].outlier; });
    return list;
}

std::string name(FaultKind kind) {
    constexpr const char* names[] = {"reading", "slip", "factor"};
    return names[static_cast<int>(kind)];
}

std::string name(Slips slips) { return slips == Slips::report ? "report" : "estimate"; }

std::string name(FaultTreatment treatment) {
    switch (treatment) {
        case FaultTreatment::none: return "none";
        case FaultTreatment::left_out: return "left_out";
        case FaultTreatment::estimated: return "estimated";
    }
    return "";
}

std::string name(FitFinding finding) {
    switch (finding) {
        case FitFinding::no_redundancy: return "no_redundancy";
        case FitFinding::no_noise: return "no_noise";
        case FitFinding::noise_factor: return "noise_factor";
        case FitFinding::misfit: return "misfit";
        case FitFinding::no_misfit: return "no_misfit";
        case FitFinding::uneven_misfit: return "uneven_misfit";
        case FitFinding::trend: return "trend";
        case FitFinding::prior: return "prior";
        case FitFinding::prior_scatter: return "prior_scatter";
        case FitFinding::fault: return "fault";
        case FitFinding::alternatives: return "alternatives";
        case FitFinding::fault_cost: return "fault_cost";
        case FitFinding::undetermined: return "undetermined";
        case FitFinding::scaled: return "scaled";
        case FitFinding::mistake: return "mistake";
        case FitFinding::implausible_input: return "implausible_input";
    }
    return "";
}

std::string name(FitAspect aspect) {
    switch (aspect) {
        case FitAspect::whole: return "";
        case FitAspect::second_half: return "second_half";
        case FitAspect::far_half: return "far_half";
        case FitAspect::time: return "time";
        case FitAspect::position: return "position";
        case FitAspect::time_or_position: return "time_or_position";
    }
    return "";
}

}  // namespace stepdiag
