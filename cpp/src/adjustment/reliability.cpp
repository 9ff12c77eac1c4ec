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
          tests_(solution.solver().equations(), solution.solver().factor(), solution.reading_variances(), hypotheses_),
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
        tests_.refine({h});
        const Eigen::VectorXd effect = tests_.effect(h);
        const Eigen::VectorXd& changes = effects_.add(h, effect);
        const double u = tests_.scores()[h].standard_uncertainty;
        const double size_found = power_of_99_percent * noise_ * u;
        if (std::isinf(u)) return note_uncontrolled(h, changes, control);
        ++control.count;
        control.found_from = std::max(control.found_from, size_found);
        for (std::size_t i = 0; i < values_.size(); ++i) {
            double& hidden = (control.*families[values_[i].family]).hidden;
            hidden = std::max(hidden, size_found * std::abs(changes[Eigen::Index(i)]));
        }
        std::vector<double> correlations = tests_.correlations(h, effect);
        double nearest = 0.0;
        bool has_twin = false;
        std::vector<int> alike;
        for (int k = 0; k < int(correlations.size()); ++k)
            if (k != h && std::abs(correlations[k]) > similar) alike.push_back(k);
        for (const int k : alike) correlations[k] /= tests_.scores()[k].standard_uncertainty;
        tests_.refine(alike);
        for (const int k : alike) correlations[k] *= tests_.scores()[k].standard_uncertainty;
        for (int k = 0; k < int(correlations.size()); ++k) {
            if (k == h) continue;
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
                double& shared = (control.*families[values_[i].family]).shared;
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
// every fault does to it. So from some columns to the rows of their largest entries, from there to the columns of
// theirs, and once more. Entries that are noted are of rows, and exact: of most slips the uncertainty is interpolated.
class Unseen {
public:
    Unseen(Solution& solution, FaultTests& tests, const CalibratedForms& forms, double noise)
        : solver_(solution.solver()),
          limit_(power_of_99_percent * noise),
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
        look_at_sizes();
        std::set<int> columns = first_columns();
        constexpr int rounds = 2;
        for (int round = 0; round < rounds && !columns.empty(); ++round) {
            look_at_rows(rows_of({columns.begin(), columns.end()}));
            columns_seen_.merge(columns);
            columns.clear();
            for (const auto& [place, entry] : best_)
                if (columns_seen_.count(entry.value) == 0) columns.insert(entry.value);
        }
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
        double effect = 0.0;
        int hypothesis = 0, value = 0;
    };

    // Of each function and squareness the value that is known worst, and both ends.
    std::set<int> first_columns() const {
        constexpr int spread = 2;
        std::set<int> columns;
        for (int first = 0, end; first < int(values_.size()); first = end) {
            int worst = first;
            for (end = first; end < int(values_.size()) && values_[end].table == values_[first].table; ++end)
                if (values_[end].standard_uncertainty > values_[worst].standard_uncertainty) worst = end;
            columns.insert(worst);
            for (int k = 0; k < spread; ++k) columns.insert(first + k * (end - 1 - first) / (spread - 1));
        }
        return columns;
    }

    double uncertainty(int h) const { return tests_.scores()[h].standard_uncertainty; }
    bool is_controlled(int h) const { return !std::isinf(uncertainty(h)); }

    // The largest of each kind. Of slips it is climbed to from the largest of those that are computed.
    void look_at_sizes() {
        std::vector<int> worst(faults_.size(), -1);
        for (int h = 0; h < int(group_.size()); ++h) {
            int& of_kind = worst[group_[h]];
            if (!is_controlled(h)) uncontrolled_[group_[h]].push_back(h);
            else if (of_kind < 0 || uncertainty(h) > uncertainty(of_kind)) of_kind = h;
        }
        worst.erase(std::remove(worst.begin(), worst.end(), -1), worst.end());
        tests_.refine(worst);
        constexpr int strides[] = {24, 12, 6, 3, 2, 1};
        for (const int stride : strides) {
            std::vector<std::pair<int, int>> steps;  // into worst, and to where
            std::vector<int> there;
            for (int w = 0; w < int(worst.size()); ++w)
                for (const int k : {worst[w] - stride, worst[w] + stride})
                    if (k >= 0 && k < int(group_.size()) && hypotheses_.all()[k].kind == FaultKind::slip &&
                        group_[k] == group_[worst[w]]) {
                        steps.emplace_back(w, k);
                        there.push_back(k);
                    }
            tests_.refine(there);
            for (const auto& [w, k] : steps)
                if (is_controlled(k) && uncertainty(k) > uncertainty(worst[w])) worst[w] = k;
        }
        look_at_rows(worst);
    }

    // What each of these faults, just not found, does to each value.
    void look_at_rows(std::vector<int> rows) {
        const auto is_seen = [&](int h) { return !rows_seen_.insert(h).second; };
        rows.erase(std::remove_if(rows.begin(), rows.end(), is_seen), rows.end());
        tests_.refine(rows);
        const auto is_open = [&](int h) { return !is_controlled(h); };
        rows.erase(std::remove_if(rows.begin(), rows.end(), is_open), rows.end());
        for_eights(rows, [&](const int* some, int count) {
            const Sides effects = tests_.effects(some, count);
            OfSides size = OfSides::Zero();
            for (int k = 0; k < count; ++k) {
                size[k] = limit_ * uncertainty(some[k]);
                double& largest = faults_[group_[some[k]]].size;
                largest = std::max(largest, size[k]);
            }
            for (int v = 0; v < int(values_.size()); ++v) {
                const OfSides changed = values_[v].form->values(effects).cwiseAbs().cwiseProduct(size);
                for (int k = 0; k < count; ++k) {
                    double& hidden = faults_[group_[some[k]]].*unseen_families[values_[v].family];
                    if (!(changed[k] > hidden)) continue;
                    hidden = changed[k];
                    best_[{group_[some[k]], values_[v].family}] = {changed[k], some[k], v};
                }
            }
        });
    }

    // For each kind of fault and each family the fault with most effect on one of these values.
    std::vector<int> rows_of(const std::vector<int>& columns) const {
        constexpr int families_count = int(std::size(unseen_families));
        const auto& all = hypotheses_.all();
        const NormalEquations& equations = solver_.equations();
        std::vector<Entry> largest(faults_.size() * families_count);
        for_eights(columns, [&](const int* some, int count) {
            Sides y = Sides::Zero(equations.problem().size(), BorderedFactor::sides);
            for (int k = 0; k < count; ++k)
                for (int i = 0; i < values_[some[k]].form->size; ++i)
                    y(values_[some[k]].form->unknown[i], k) += values_[some[k]].form->coefficient[i];
            solver_.factor().solve(y);
            const std::vector<OfSides> effects = effects_on(y);
            for (int h = 0; h < int(all.size()); ++h) {
                if (!is_controlled(h)) continue;
                const OfSides changed = limit_ * uncertainty(h) * effects[h].cwiseAbs();
                for (int k = 0; k < count; ++k) {
                    Entry& entry = largest[group_[h] * families_count + values_[some[k]].family];
                    if (changed[k] > entry.effect) entry = {changed[k], h, some[k]};
                }
            }
        });
        std::vector<int> rows;
        for (const Entry& entry : largest)
            if (entry.effect > 0.0) rows.push_back(entry.hypothesis);
        return rows;
    }

    // Of each fault of size 1, from N^-1 of the values' forms.
    std::vector<OfSides> effects_on(const Sides& y) const {
        const NormalEquations& equations = solver_.equations();
        std::vector<OfSides> of(equations.problem().readings().size(), OfSides::Zero()), effects(group_.size());
        for (int r = 0; r < int(of.size()); ++r) {
            const AdjustedReading& reading = equations.problem().readings()[r];
            if (reading.used()) of[r] = equations.row(r).products(y) / reading.standard_uncertainty;
        }
        std::vector<std::vector<OfSides>> from;  // of a sequence from each place to its end
        for (const ReadingSequence& sequence : hypotheses_.sequences()) {
            auto& sums = from.emplace_back(sequence.readings.size() + 1, OfSides::Zero());
            for (std::size_t i = sequence.readings.size(); i-- > 0;) sums[i] = sums[i + 1] + of[sequence.readings[i]];
        }
        for (int h = 0; h < int(group_.size()); ++h) {
            const FaultHypothesis& fault = hypotheses_.all()[h];
            effects[h] = OfSides::Zero();
            if (fault.kind == FaultKind::slip) effects[h] = from[fault.sequence][fault.first];
            else
                for (const int r : hypotheses_.readings(fault)) effects[h] += hypotheses_.share(fault, r) * of[r];
        }
        return effects;
    }

    void look_at_uncontrolled() {
        for (const auto& [group, list] : uncontrolled_) {
            std::vector<int> rows;
            const std::size_t step = (list.size() + most_uncontrolled - 1) / most_uncontrolled;
            for (std::size_t i = 0; i < list.size(); i += step) rows.push_back(list[i]);
            UnseenFault& faults = faults_[group];
            for_eights(rows, [&](const int* some, int count) {
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

    template <class Function>
    static void for_eights(const std::vector<int>& list, const Function& function) {
        for (std::size_t i = 0; i < list.size(); i += BorderedFactor::sides)
            function(list.data() + i, int(std::min<std::size_t>(BorderedFactor::sides, list.size() - i)));
    }

    const GaussNewton& solver_;
    double limit_;
    std::vector<CalibratedValue> values_;
    const FaultHypotheses& hypotheses_;
    FaultTests& tests_;
    std::vector<UnseenFault> faults_;
    std::vector<int> group_;  // by hypothesis, into faults_
    std::map<int, std::vector<int>> uncontrolled_;
    std::map<Place, Entry> best_;
    std::set<int> rows_seen_, columns_seen_;
};

}  // namespace

std::vector<UnseenFault> unseen_faults(Solution& solution, FaultTests& tests, const CalibratedForms& forms,
                                       double noise) {
    return Unseen(solution, tests, forms, noise).look();
}

std::vector<FaultControl> reliability(Solution& solution, const CalibratedForms& forms, double noise) {
    return Reliability(solution, forms, noise).look();
}

}  // namespace stepdiag
