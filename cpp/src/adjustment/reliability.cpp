#include "adjustment/reliability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
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

// The largest entries of the matrix whose element (h, v) is what fault h, just not found, does to value v, for each kind
// of fault and family of values. A row takes one solution, a column as well: N^-1 of the value's form tells what every
// fault does to it. So from some columns to the rows of their largest entries, from there to the columns of theirs, and
// once more.
class Unseen {
public:
    Unseen(const GaussNewton& solver, const BorderedBand& inverse, const CalibratedForms& forms, double noise)
        : solver_(solver),
          limit_(power_of_99_percent * noise),
          values_(calibrated_values(forms, inverse)),
          columns_(first_columns(forms)),
          hypotheses_(solver.equations().problem()),
          tests_(solver.equations(), solver.factor(), inverse, hypotheses_, slips_computed) {
        const auto& all = hypotheses_.all();
        std::map<std::pair<std::string, FaultKind>, int> number;
        for (const FaultHypothesis& h : all) {
            const std::string channel = channel_of(solver.equations().problem(), hypotheses_, h);
            const auto [place, is_new] = number.try_emplace({channel, h.kind}, int(faults_.size()));
            if (is_new) faults_.push_back({h.kind, channel});
            group_.push_back(place->second);
        }
    }

    std::vector<UnseenFault> look() {
        take_worst_controlled();
        constexpr int rounds = 2;
        for (int round = 0; round < rounds && !columns_.empty(); ++round) {
            for (const int v : columns_) take_column(v);
            columns_.clear();
            std::set<int> rows;
            for (const auto& [place, best] : best_) rows.insert(best.hypothesis);
            for (const int h : rows)
                if (rows_done_.insert(h).second) take_row(h);
            for (const auto& [place, best] : best_)
                if (columns_done_.count(best.value) == 0) columns_.insert(best.value);
        }
        look_at_uncontrolled();
        return faults_;
    }

private:
    static constexpr int slips_computed = 60;        // of the others the uncertainty is interpolated
    static constexpr int most_uncontrolled = 20;     // of a kind, evenly spaced
    static constexpr double nothing = 1e-4;          // of a value's standard uncertainty: rounding
    using Family = double UnseenFault::*;

    struct Best {
        double effect = 0.0;
        int hypothesis = 0, value = 0;
    };

    static int family_number(Effect FaultControl::* family) {
        return family == &FaultControl::positioning    ? 0
               : family == &FaultControl::straightness ? 1
               : family == &FaultControl::angle        ? 2
                                                       : 3;
    }
    static Family family(int number) {
        constexpr Family all[] = {&UnseenFault::positioning, &UnseenFault::straightness, &UnseenFault::angle,
                                  &UnseenFault::squareness};
        return all[number];
    }

    // Of each function the last value and that which is known worst; all squarenesses.
    std::set<int> first_columns(const CalibratedForms& forms) const {
        std::set<int> columns;
        int v = 0;
        const auto add = [&](const std::vector<LinearForm>& list) {
            int worst = -1, last = -1;
            for (const LinearForm& form : list) {
                if (form.size == 0) continue;
                last = v++;
                if (worst < 0 || values_[last].standard_uncertainty > values_[worst].standard_uncertainty) worst = last;
            }
            if (last >= 0) columns.insert({worst, last});
        };
        for (const auto& function : forms.functions)
            if (function) add(function->value);
        for (const auto& squareness : forms.squarenesses)
            if (squareness) add({*squareness});
        return columns;
    }

    bool is_controlled(int h) const { return !std::isinf(tests_.scores()[h].standard_uncertainty); }
    double size_found(int h) const { return limit_ * tests_.scores()[h].standard_uncertainty; }

    // Of each kind the largest size; of slips that is among those computed, because the others are interpolated.
    void take_worst_controlled() {
        std::vector<int> worst(faults_.size(), -1);
        for (int h = 0; h < int(group_.size()); ++h) {
            UnseenFault& fault = faults_[group_[h]];
            if (!is_controlled(h)) {
                uncontrolled_[group_[h]].push_back(h);
            } else if (size_found(h) > fault.size) {
                fault.size = size_found(h);
                worst[group_[h]] = h;
            }
        }
        for (const int h : worst)
            if (h >= 0 && rows_done_.insert(h).second) take_row(h);
    }

    void note(int h, int v, double effect) {
        Best& best = best_[{group_[h], family_number(values_[v].family)}];
        if (!(effect > best.effect)) return;
        best = {effect, h, v};
        faults_[group_[h]].*family(family_number(values_[v].family)) = effect;
    }

    void take_row(int h) {
        tests_.refine(h);
        if (!is_controlled(h)) return;
        const Eigen::VectorXd effect = tests_.effect(h);
        const double size = size_found(h);
        for (int v = 0; v < int(values_.size()); ++v) note(h, v, size * std::abs(values_[v].form->value(effect)));
    }

    void take_column(int v) {
        columns_done_.insert(v);
        const NormalEquations& equations = solver_.equations();
        const AdjustmentProblem& problem = equations.problem();
        Eigen::VectorXd y = Eigen::VectorXd::Zero(problem.size());
        for (int i = 0; i < values_[v].form->size; ++i)
            y[values_[v].form->unknown[i]] += values_[v].form->coefficient[i];
        solver_.factor().solve(y);
        // By reading, and from each place of a sequence to its end.
        std::vector<std::vector<double>> of, from;
        for (const ReadingSequence& sequence : hypotheses_.sequences()) {
            const std::size_t count = sequence.readings.size();
            auto& each = of.emplace_back(count, 0.0);
            auto& sums = from.emplace_back(count + 1, 0.0);
            for (std::size_t i = count; i-- > 0;) {
                const int r = sequence.readings[i];
                const AdjustedReading& reading = problem.readings()[r];
                if (reading.used()) each[i] = equations.row(r).product(y) / reading.standard_uncertainty;
                sums[i] = sums[i + 1] + each[i];
            }
        }
        const auto& all = hypotheses_.all();
        for (int h = 0; h < int(all.size()); ++h) {
            if (!is_controlled(h)) continue;
            const auto& effects = all[h].kind == FaultKind::reading ? of : from;
            note(h, v, size_found(h) * std::abs(effects[all[h].sequence][all[h].first]));
        }
    }

    void look_at_uncontrolled() {
        for (const auto& [group, list] : uncontrolled_) {
            const std::size_t step = (list.size() + most_uncontrolled - 1) / most_uncontrolled;
            for (std::size_t i = 0; i < list.size(); i += step) {
                const Eigen::VectorXd effect = tests_.effect(list[i]);
                const double noise = 1.0 / std::sqrt(tests_.square(list[i]));
                for (const CalibratedValue& value : values_) {
                    if (!(noise * std::abs(value.form->value(effect)) > nothing * value.standard_uncertainty)) continue;
                    faults_[group].controlled = false;
                    faults_[group].*family(family_number(value.family)) = std::numeric_limits<double>::infinity();
                }
            }
        }
    }

    const GaussNewton& solver_;
    double limit_;
    std::vector<CalibratedValue> values_;
    std::set<int> columns_;
    FaultHypotheses hypotheses_;
    FaultTests tests_;
    std::vector<UnseenFault> faults_;
    std::vector<int> group_;  // by hypothesis, into faults_
    std::map<int, std::vector<int>> uncontrolled_;
    std::map<std::pair<int, int>, Best> best_;  // by kind of fault and family
    std::set<int> rows_done_, columns_done_;
};

}  // namespace

std::vector<UnseenFault> unseen_faults(const GaussNewton& solver, const BorderedBand& inverse,
                                       const CalibratedForms& forms, double noise) {
    return Unseen(solver, inverse, forms, noise).look();
}

std::vector<FaultControl> reliability(const GaussNewton& solver, const BorderedBand& inverse,
                                      const CalibratedForms& forms, double noise) {
    return Reliability(solver, inverse, forms, noise).look();
}

}  // namespace stepdiag
