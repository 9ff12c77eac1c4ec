#include "adjustment/reliability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace stepdiag {
namespace {

constexpr double power_of_99_percent = 7.6;  // square root of the noncentrality: sqrt(28) + 2.3
constexpr double told_apart = 25.0;          // difference of chi-square
constexpr double twin = 0.999;               // correlation
constexpr double similar = 0.5;              // where the correlation of interpolated scores may be that of a twin
constexpr double most_numbers = 4e6;         // of effects kept
constexpr std::size_t fewest_places = 200;

using Effect = FaultControl::Effect;

struct CalibratedValue {
    const LinearForm* form;
    Effect FaultControl::* family;
    double standard_uncertainty;
};

std::vector<CalibratedValue> calibrated_values(const CalibratedForms& forms, const BorderedBand& inverse) {
    std::vector<CalibratedValue> values;
    const auto add = [&](const LinearForm& form, Effect FaultControl::* family) {
        if (form.size > 0) values.push_back({&form, family, std::sqrt(std::max(0.0, form.variance(inverse)))});
    };
    for (int i = 0; i < function_count; ++i) {
        if (!forms.functions[i]) continue;
        const FunctionId id = FunctionId::at(i);
        const auto family = id.is_rotation()       ? &FaultControl::angle
                            : id.is_straightness() ? &FaultControl::straightness
                                                   : &FaultControl::positioning;
        for (const LinearForm& form : forms.functions[i]->value) add(form, family);
    }
    for (const auto& form : forms.squarenesses)
        if (form) add(*form, &FaultControl::squareness);
    return values;
}

std::string channel_of(const AdjustmentProblem& problem, const FaultHypotheses& hypotheses,
                       const FaultHypothesis& hypothesis) {
    const std::string name = problem.channel_name(problem.readings()[*hypotheses.readings(hypothesis).begin()]);
    return name.front() == 'd' ? "distance" : name.front() == 's' ? "spot" : "tilt";
}

// What a fault of size 1 does to the calibrated values, kept.
class Effects {
public:
    Effects(const FaultTests& tests, const std::vector<CalibratedValue>& values) : tests_(tests), values_(values) {}

    const Eigen::VectorXd& add(int hypothesis, const Eigen::VectorXd& effect) {
        Eigen::VectorXd& changes = kept_[hypothesis];
        if (changes.size() > 0 || values_.empty()) return changes;
        changes.resize(Eigen::Index(values_.size()));
        for (std::size_t i = 0; i < values_.size(); ++i) changes[Eigen::Index(i)] = values_[i].form->value(effect);
        return changes;
    }
    const Eigen::VectorXd& of(int hypothesis) {
        const auto found = kept_.find(hypothesis);
        return found != kept_.end() ? found->second : add(hypothesis, tests_.effect(hypothesis));
    }

private:
    const FaultTests& tests_;
    const std::vector<CalibratedValue>& values_;
    std::map<int, Eigen::VectorXd> kept_;
};

class Reliability {
public:
    Reliability(const GaussNewton& solver, const BorderedBand& inverse, const CalibratedForms& forms, double noise)
        : noise_(noise),
          problem_(solver.equations().problem()),
          values_(calibrated_values(forms, inverse)),
          hypotheses_(problem_),
          tests_(solver.equations(), solver.factor(), inverse, hypotheses_),
          effects_(tests_, values_) {}

    std::vector<FaultControl> look() {
        std::map<std::pair<std::string, FaultKind>, std::vector<int>> groups;
        const auto& all = hypotheses_.all();
        for (std::size_t h = 0; h < all.size(); ++h)
            groups[{channel_of(problem_, hypotheses_, all[h]), all[h].kind}].push_back(int(h));
        const auto places = std::max(fewest_places, std::size_t(most_numbers / double(values_.size() + 1)));
        const std::size_t step = (all.size() + places - 1) / places;
        std::vector<FaultControl> controls;
        for (const auto& [place, group] : groups) {
            FaultControl& control = controls.emplace_back();
            control.channel = place.first;
            control.kind = place.second;
            for (std::size_t i = 0; i < group.size(); i += step) look_at(group[i], control);
        }
        return controls;
    }

private:
    void look_at(int h, FaultControl& control) {
        tests_.refine(h);
        const Eigen::VectorXd effect = tests_.effect(h);
        const Eigen::VectorXd& changes = effects_.add(h, effect);
        const double u = tests_.scores()[h].standard_uncertainty;
        const double size_found = power_of_99_percent * noise_ * u;
        if (std::isinf(u)) return note_uncontrolled(h, changes, control);
        ++control.count;
        control.found_from = std::max(control.found_from, size_found);
        for (std::size_t i = 0; i < values_.size(); ++i) {
            double& hidden = (control.*values_[i].family).hidden;
            hidden = std::max(hidden, size_found * std::abs(changes[Eigen::Index(i)]));
        }
        std::vector<double> correlations = tests_.correlations(h, effect);
        double nearest = 0.0;
        bool has_twin = false;
        for (int k = 0; k < int(correlations.size()); ++k) {
            if (k == h) continue;
            if (std::abs(correlations[k]) > similar) {
                const double before = tests_.scores()[k].standard_uncertainty;
                tests_.refine(k);
                correlations[k] *= tests_.scores()[k].standard_uncertainty / before;
            }
            if (std::abs(correlations[k]) < twin) {
                nearest = std::max(nearest, std::abs(correlations[k]));
                continue;
            }
            // The size that the twin would be found with.
            const double size = correlations[k] * tests_.scores()[k].standard_uncertainty / u;
            const Eigen::VectorXd difference = changes - size * effects_.of(k);
            if (!matters(h, difference)) continue;
            has_twin = true;
            for (std::size_t i = 0; i < values_.size(); ++i) {
                double& shared = (control.*values_[i].family).shared;
                shared = std::max(shared, std::abs(difference[Eigen::Index(i)]));
            }
        }
        if (has_twin) ++control.twins;
        else
            control.told_from =
                std::max(control.told_from, noise_ * std::sqrt(told_apart / (1.0 - nearest * nearest)) * u);
    }

    // Of any size. It does no harm where it is a constant that the set-up takes up.
    void note_uncontrolled(int h, const Eigen::VectorXd& changes, FaultControl& control) const {
        if (!matters(h, changes)) return;
        ++control.uncontrolled;
        for (std::size_t i = 0; i < values_.size(); ++i)
            if (matters(h, changes, i)) (control.*values_[i].family).hidden = std::numeric_limits<double>::infinity();
    }

    // Whether changes by a fault of size 1 are more than rounding: of what a fault does that is its readings' noise.
    bool matters(int h, const Eigen::VectorXd& changes, std::size_t value) const {
        constexpr double nothing = 1e-4;  // of the value's standard uncertainty
        const double noise = 1.0 / std::sqrt(tests_.square(h));
        return noise * std::abs(changes[Eigen::Index(value)]) > nothing * values_[value].standard_uncertainty;
    }
    bool matters(int h, const Eigen::VectorXd& changes) const {
        for (std::size_t i = 0; i < values_.size(); ++i)
            if (matters(h, changes, i)) return true;
        return false;
    }

    double noise_;
    const AdjustmentProblem& problem_;
    std::vector<CalibratedValue> values_;
    FaultHypotheses hypotheses_;
    FaultTests tests_;
    Effects effects_;
};

}  // namespace

std::vector<FaultControl> reliability(const GaussNewton& solver, const BorderedBand& inverse,
                                      const CalibratedForms& forms, double noise) {
    return Reliability(solver, inverse, forms, noise).look();
}

}  // namespace stepdiag
