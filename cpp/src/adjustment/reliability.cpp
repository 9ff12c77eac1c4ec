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
            double& hidden = (control.*families[values_[i].family]).hidden;
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
    Unseen(const GaussNewton& solver, const BorderedBand& inverse, const CalibratedForms& forms, double noise)
        : solver_(solver),
          limit_(power_of_99_percent * noise),
          values_(calibrated_values(forms, inverse)),
          hypotheses_(solver.equations().problem()),
          tests_(solver.equations(), solver.factor(), inverse, hypotheses_, slips_computed) {
        std::map<std::pair<std::string, FaultKind>, int> number;
        for (const FaultHypothesis& h : hypotheses_.all()) {
            const std::string channel = channel_of(solver.equations().problem(), hypotheses_, h);
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
            std::map<Place, Entry> largest;
            for (const int v : columns) look_at_column(v, largest);
            for (const auto& [place, entry] : largest) look_at_row(entry.hypothesis);
            columns_seen_.merge(columns);
            columns.clear();
            for (const auto& [place, entry] : best_)
                if (columns_seen_.count(entry.value) == 0) columns.insert(entry.value);
        }
        look_at_uncontrolled();
        return faults_;
    }

private:
    static constexpr int slips_computed = 100;    // of others the uncertainty is interpolated, some 20 % at worst
    static constexpr int most_uncontrolled = 20;  // of a kind, evenly spaced
    static constexpr double nothing = 1e-4;       // of a value's standard uncertainty: rounding
    using Place = std::pair<int, int>;            // kind of fault and family
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
        for (int h : worst) {
            if (h < 0) continue;
            tests_.refine(h);
            constexpr int strides[] = {24, 12, 6, 3, 2, 1};
            for (const int stride : strides)
                for (const int k : {h - stride, h + stride})
                    if (k >= 0 && k < int(group_.size()) && hypotheses_.all()[k].kind == FaultKind::slip &&
                        group_[k] == group_[h]) {
                        tests_.refine(k);
                        if (is_controlled(k) && uncertainty(k) > uncertainty(h)) h = k;
                    }
            look_at_row(h);
        }
    }

    void look_at_row(int h) {
        if (!rows_seen_.insert(h).second) return;
        tests_.refine(h);
        if (!is_controlled(h)) return;
        UnseenFault& fault = faults_[group_[h]];
        const double size = limit_ * uncertainty(h);
        fault.size = std::max(fault.size, size);
        const Eigen::VectorXd effect = tests_.effect(h);
        for (int v = 0; v < int(values_.size()); ++v) {
            const double changed = size * std::abs(values_[v].form->value(effect));
            double& hidden = fault.*unseen_families[values_[v].family];
            if (!(changed > hidden)) continue;
            hidden = changed;
            best_[{group_[h], values_[v].family}] = {changed, h, v};
        }
    }

    // The fault of each kind with most effect on a value, if it is larger than those that are there.
    void look_at_column(int v, std::map<Place, Entry>& largest) const {
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
            const ReadingSequence& sequence = hypotheses_.sequences()[all[h].sequence];
            double effect = (all[h].kind == FaultKind::reading ? of : from)[all[h].sequence][all[h].first];
            if (all[h].kind == FaultKind::factor) {
                effect = 0.0;
                for (std::size_t i = 0; i < sequence.readings.size(); ++i)
                    effect += hypotheses_.share(all[h], sequence.readings[i]) * of[all[h].sequence][i];
            }
            const double changed = limit_ * uncertainty(h) * std::abs(effect);
            Entry& entry = largest[{group_[h], values_[v].family}];
            if (changed > entry.effect) entry = {changed, h, v};
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
                    faults_[group].*unseen_families[value.family] = std::numeric_limits<double>::infinity();
                }
            }
        }
    }

    const GaussNewton& solver_;
    double limit_;
    std::vector<CalibratedValue> values_;
    FaultHypotheses hypotheses_;
    FaultTests tests_;
    std::vector<UnseenFault> faults_;
    std::vector<int> group_;  // by hypothesis, into faults_
    std::map<int, std::vector<int>> uncontrolled_;
    std::map<Place, Entry> best_;
    std::set<int> rows_seen_, columns_seen_;
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
