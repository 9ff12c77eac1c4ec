#include "diagnosis/fault_cost.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "stepdiag/evaluation/thresholds.hpp"
#include "stepdiag/machine/parameter.hpp"

namespace stepdiag {
namespace {

struct Largest {
    double uncertainty = 0.0;
    std::string parameter = {};

    void take(double u, const std::string& name) {
        if (u > uncertainty) *this = {u, name};
    }
};

// Of positioning, straightness, angle, squareness.
std::array<Largest, 4> largest_uncertainties(const Calibration& calibration) {
    std::array<Largest, 4> largest;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (const auto& function = calibration.functions[std::size_t(i)])
            for (const double u : function->standard_uncertainty)
                largest[id.is_rotation() ? 2 : id.is_straightness() ? 1 : 0].take(u, id.name());
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& found = calibration.squarenesses[std::size_t(s)])
            largest[3].take(found->standard_uncertainty, name(s));
    return largest;
}

// Parameters of which something was determined and is no more.
std::string lost_parameters(const Calibration& with, const Calibration& without) {
    std::string lost;
    const auto add = [&](const std::string& name) { lost += (lost.empty() ? "" : ", ") + name; };
    for (std::size_t i = 0; i < function_count; ++i) {
        const auto &now = with.functions[i], &before = without.functions[i];
        if (!before) continue;
        const bool keeps_all = now && std::includes(now->position.begin(), now->position.end(),
                                                    before->position.begin(), before->position.end());
        if (!keeps_all || (before->slope_determined && !now->slope_determined)) add(FunctionId::at(int(i)).name());
    }
    for (const Squareness s : all_squarenesses)
        if (without.squarenesses[std::size_t(s)] && !with.squarenesses[std::size_t(s)]) add(name(s));
    return lost;
}

}  // namespace

std::vector<FitReason> costs_of_faults(const Calibration& with, const Calibration& without) {
    std::vector<FitReason> reasons;
    if (const std::string lost = lost_parameters(with, without); !lost.empty()) {
        FitReason reason{FitFinding::undetermined, 0.0, 0.0};
        reason.parameter = lost;
        reasons.push_back(reason);
    }
    const auto now = largest_uncertainties(with), before = largest_uncertainties(without);
    for (std::size_t family = 0; family < now.size(); ++family) {
        if (!(now[family].uncertainty > thresholds.fault_cost * before[family].uncertainty)) continue;
        if (before[family].uncertainty == 0.0) continue;
        FitReason reason{FitFinding::fault_cost, now[family].uncertainty / before[family].uncertainty,
                         thresholds.fault_cost};
        reason.parameter = now[family].parameter;
        reasons.push_back(reason);
    }
    return reasons;
}

}  // namespace stepdiag
