#include "diagnosis/reliability.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

constexpr double twin = 0.999;        // correlation
constexpr double most_numbers = 4e6;  // of effects kept
constexpr std::size_t fewest_places = 200;

using Effect = FaultControl::Effect;

constexpr Effect FaultControl::* families[] = {&FaultControl::positioning, &FaultControl::straightness,
                                               &FaultControl::angle, &FaultControl::squareness};
constexpr double UnseenFault::* unseen_families[] = {&UnseenFault::positioning, &UnseenFault::straightness,
                                                     &UnseenFault::angle, &UnseenFault::squareness};

struct CalibratedValue {
    const LinearForm* form;
    int family;  // into the two above
    int table;   // a number for each function and squareness
    double standard_uncertainty;
};

std::vector<CalibratedValue> calibrated_values(const CalibratedForms& forms, const BorderedBand& inverse) {
    std::vector<CalibratedValue> values;
    const auto add = [&](const LinearForm& form, int family, int table) {
        if (form.size == 0) return;
        values.push_back({&form, family, table, std::sqrt(std::max(0.0, form.variance(inverse)))});
    };
    for (int i = 0; i < function_count; ++i) {
        if (!forms.functions[i]) continue;
        const FunctionId id = FunctionId::at(i);
        const int family = id.is_rotation() ? 2 : id.is_straightness() ? 1 : 0;
        for (const LinearForm& form : forms.functions[i]->value) add(form, family, i);
    }
    for (int i = 0; i < squareness_count; ++i)
        if (forms.squarenesses[i]) add(*forms.squarenesses[i], 3, function_count + i);
    return values;
}

std::string channel_of(const AdjustmentProblem& problem, const FaultHypotheses& hypotheses,
                       const FaultHypothesis& hypothesis) {
    const std::string name = problem.channel_name(problem.readings()[*hypotheses.readings(hypothesis).begin()]);
    return name.front() == 'd' ? "distance" : name.front() == 's' ? "spot" : "tilt";
}

template <class Function>
void for_sixteens(const std::vector<int>& list, const Function& function) {
    for (std::size_t i = 0; i < list.size(); i += BorderedFactor::sides)
        function(list.data() + i, int(std::min<std::size_t>(BorderedFactor::sides, list.size() - i)));
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
    Reliability(Solution& solution, const CalibratedForms& forms, double noise)
        : noise_(noise),
          problem_(solution.problem()),
          values_(calibrated_values(forms, solution.inverse())),
          hypotheses_(problem_),
          tests_(solution.solver().equations(), solution.solver().factor(), solution.inverse(),
                 solution.reading_variances(), hypotheses_),
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
            std::vector<int> some;
            for (std::size_t i = 0; i < group.size(); i += step) some.push_back(group[i]);
            for_sixteens(some, [&](const int* of, int count) { look_at(of, count, control); });
        }
        return controls;
    }

private:
    struct Twin {
        int hypothesis;
        double correlation;
    };

    void look_at(const int* some, int count, FaultControl& control) {
        const BorderedFactor::Sides effects = tests_.effects(some, count);
        std::array<double, BorderedFactor::sides> nearest{};
        std::array<std::vector<Twin>, BorderedFactor::sides> twins;
        tests_.each_correlation(some, count, effects, [&](int h, const BorderedFactor::OfSides& correlation) {
            for (int k = 0; k < count; ++k) {
                if (h == some[k]) continue;
                if (std::abs(correlation[k]) < twin) nearest[k] = std::max(nearest[k], std::abs(correlation[k]));
                else twins[k].push_back({h, correlation[k]});
            }
        });
        for (int k = 0; k < count; ++k) {
            const Eigen::VectorXd& changes = effects_.add(some[k], effects.col(k));
            if (std::isinf(tests_.scores()[some[k]].standard_uncertainty)) note_uncontrolled(some[k], changes, control);
            else note_controlled(some[k], changes, nearest[k], twins[k], control);
        }
    }

    // `nearest`: the largest correlation with a fault that is no twin.
    void note_controlled(int h, const Eigen::VectorXd& changes, double nearest, const std::vector<Twin>& twins,
                         FaultControl& control) {
        const double u = tests_.scores()[h].standard_uncertainty;
        const double size_found = thresholds.found_with_99_percent * noise_ * u;
        ++control.count;
        control.found_from = std::max(control.found_from, size_found);
        for (std::size_t i = 0; i < values_.size(); ++i) {
            double& hidden = (control.*families[values_[i].family]).hidden;
            hidden = std::max(hidden, size_found * std::abs(changes[Eigen::Index(i)]));
        }
        bool has_twin = false;
        for (const Twin& twin : twins) {
            // The size that the twin would be found with.
            const double size = twin.correlation * tests_.scores()[twin.hypothesis].standard_uncertainty / u;
            const Eigen::VectorXd difference = changes - size * effects_.of(twin.hypothesis);
            if (!matters(h, difference)) continue;
            has_twin = true;
            for (std::size_t i = 0; i < values_.size(); ++i) {
                double& shared = (control.*families[values_[i].family]).shared;
                shared = std::max(shared, std::abs(difference[Eigen::Index(i)]));
            }
        }
        if (has_twin) ++control.twins;
        else
            control.distinguished_from = std::max(
                control.distinguished_from, noise_ * std::sqrt(thresholds.alternative / (1.0 - nearest * nearest)) * u);
    }

    // Of any size. It does no harm where it is a constant that the set-up takes up.
    void note_uncontrolled(int h, const Eigen::VectorXd& changes, FaultControl& control) const {
        if (!matters(h, changes)) return;
        ++control.uncontrolled;
        for (std::size_t i = 0; i < values_.size(); ++i)
            if (matters(h, changes, i))
                (control.*families[values_[i].family]).hidden = std::numeric_limits<double>::infinity();
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

// The largest entries of the matrix whose element (h, v) is what fault h, just not found, does to value v, for each
// kind of fault and family of values. A row takes one solution, a column as well: N^-1 of the value's form tells what
// every fault does to it. So from some columns to the rows of their largest entries, and from there to the columns of
// theirs.
class Unseen {
public:
    Unseen(Solution& solution, const FaultTests& tests, const CalibratedForms& forms, double noise)
        : solver_(solution.solver()),
          limit_(thresholds.found_with_99_percent * noise),
          values_(calibrated_values(forms, solution.inverse())),
          hypotheses_(tests.hypotheses()),
          tests_(tests) {
        std::map<std::pair<std::string, FaultKind>, int> number;
        for (const FaultHypothesis& h : hypotheses_.all()) {
            const std::string channel = channel_of(solution.problem(), hypotheses_, h);
            const auto [place, is_new] = number.try_emplace({channel, h.kind}, int(faults_.size()));
            if (is_new) faults_.push_back({h.kind, channel});
            group_.push_back(place->second);
        }
    }

    std::vector<UnseenFault> look() {
        look_at_columns(first_columns());
        look_at_rows();
        look_at_columns(columns_of_largest());
        look_at_uncontrolled();
        return faults_;
    }

private:
    static constexpr int most_uncontrolled = 20;  // of a kind, evenly spaced
    static constexpr double nothing = 1e-4;       // of a value's standard uncertainty: rounding
    using Place = std::pair<int, int>;            // kind of fault and family
    using Sides = BorderedFactor::Sides;
    using OfSides = BorderedFactor::OfSides;
    struct Entry {
        int hypothesis = 0, value = 0;
    };

    // Of each function and squareness the value that is known worst, and both ends.
    std::vector<int> first_columns() {
        constexpr int spread = 2;
        for (int first = 0, end; first < int(values_.size()); first = end) {
            int worst = first;
            for (end = first; end < int(values_.size()) && values_[end].table == values_[first].table; ++end)
                if (values_[end].standard_uncertainty > values_[worst].standard_uncertainty) worst = end;
            columns_seen_.insert(worst);
            for (int k = 0; k < spread; ++k) columns_seen_.insert(first + k * (end - 1 - first) / (spread - 1));
        }
        return {columns_seen_.begin(), columns_seen_.end()};
    }

    std::vector<int> columns_of_largest() {
        std::vector<int> columns;
        for (const auto& [place, entry] : best_)
            if (columns_seen_.insert(entry.value).second) columns.push_back(entry.value);
        return columns;
    }

    double uncertainty(int h) const { return tests_.scores()[h].standard_uncertainty; }
    bool is_controlled(int h) const { return !std::isinf(uncertainty(h)); }

    double& hidden(int group, int value) { return faults_[group].*unseen_families[values_[value].family]; }
    void note(int h, int value, double effect) {
        double& largest = hidden(group_[h], value);
        if (!(effect > largest)) return;
        largest = effect;
        best_[{group_[h], values_[value].family}] = {h, value};
    }

    // Of each kind of fault the largest, and those that do most.
    void look_at_rows() {
        std::vector<int> worst(faults_.size(), -1);
        for (int h = 0; h < int(group_.size()); ++h) {
            int& of_kind = worst[group_[h]];
            if (!is_controlled(h)) uncontrolled_[group_[h]].push_back(h);
            else if (of_kind < 0 || uncertainty(h) > uncertainty(of_kind)) of_kind = h;
        }
        std::set<int> rows(worst.begin(), worst.end());
        rows.erase(-1);
        for (const int h : rows) faults_[group_[h]].size = limit_ * uncertainty(h);
        for (const auto& [place, entry] : best_) rows.insert(entry.hypothesis);
        for_sixteens({rows.begin(), rows.end()}, [&](const int* some, int count) {
            const Sides effects = tests_.effects(some, count);
            OfSides size = OfSides::Zero();
            for (int k = 0; k < count; ++k) size[k] = limit_ * uncertainty(some[k]);
            for (int v = 0; v < int(values_.size()); ++v) {
                const OfSides changed = values_[v].form->values(effects).cwiseAbs().cwiseProduct(size);
                for (int k = 0; k < count; ++k) note(some[k], v, changed[k]);
            }
        });
    }

    // What all faults do to each of these values.
    void look_at_columns(const std::vector<int>& columns) {
        const NormalEquations& equations = solver_.equations();
        for_sixteens(columns, [&](const int* some, int count) {
            Sides y = Sides::Zero(equations.problem().size(), BorderedFactor::sides);
            for (int k = 0; k < count; ++k)
                for (int i = 0; i < values_[some[k]].form->size; ++i)
                    y(values_[some[k]].form->unknown[i], k) += values_[some[k]].form->coefficient[i];
            solver_.factor().solve(y);
            std::vector<OfSides> largest(faults_.size(), OfSides::Constant(std::numeric_limits<double>::infinity()));
            for (std::size_t g = 0; g < faults_.size(); ++g)
                for (int k = 0; k < count; ++k) largest[g][k] = hidden(int(g), some[k]);
            tests_.each_effect(y, [&](int h, const OfSides& effect) {
                if (!is_controlled(h)) return;
                const OfSides changed = limit_ * uncertainty(h) * effect.cwiseAbs();
                OfSides& so_far = largest[std::size_t(group_[h])];
                if (!(changed.array() > so_far.array()).any()) return;
                for (int k = 0; k < count; ++k) note(h, some[k], changed[k]);
                so_far = so_far.cwiseMax(changed);
            });
        });
    }

    void look_at_uncontrolled() {
        for (const auto& [group, list] : uncontrolled_) {
            std::vector<int> rows;
            const std::size_t step = (list.size() + most_uncontrolled - 1) / most_uncontrolled;
            for (std::size_t i = 0; i < list.size(); i += step) rows.push_back(list[i]);
            UnseenFault& faults = faults_[group];
            for_sixteens(rows, [&](const int* some, int count) {
                const Sides effects = tests_.effects(some, count);
                OfSides noise = OfSides::Zero();
                for (int k = 0; k < count; ++k) noise[k] = 1.0 / std::sqrt(tests_.square(some[k]));
                for (const CalibratedValue& value : values_) {
                    const OfSides changed = value.form->values(effects).cwiseAbs().cwiseProduct(noise);
                    if (!(changed.maxCoeff() > nothing * value.standard_uncertainty)) continue;
                    faults.controlled = false;
                    faults.*unseen_families[value.family] = std::numeric_limits<double>::infinity();
                }
            });
        }
    }

    const GaussNewton& solver_;
    double limit_;
    std::vector<CalibratedValue> values_;
    const FaultHypotheses& hypotheses_;
    const FaultTests& tests_;
    std::vector<UnseenFault> faults_;
    std::vector<int> group_;  // by hypothesis, into faults_
    std::map<int, std::vector<int>> uncontrolled_;
    std::map<Place, Entry> best_;
    std::set<int> columns_seen_;
};

}  // namespace

std::vector<UnseenFault> unseen_faults(Solution& solution, const FaultTests& tests, const CalibratedForms& forms,
                                       double noise) {
    return Unseen(solution, tests, forms, noise).look();
}

std::vector<FaultControl> reliability(Solution& solution, const CalibratedForms& forms, double noise) {
    return Reliability(solution, forms, noise).look();
}

}  // namespace stepdiag
