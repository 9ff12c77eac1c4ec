#include "diagnosis/fault_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/SpecialFunctions>
#include <utility>

#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double twin = 0.99;  // correlation of what shows the same in all other readings
constexpr std::size_t most_exact = 20;
constexpr std::size_t most_members = 40;  // which are near enough to what is behind them

// Two-sided, squared: 28 for a probability of 1.2e-7.
double gain_of_probability(double probability) { return std::pow(Eigen::numext::ndtri(0.5 * probability), 2); }

// How much larger than stated the scatter is where a fault has taken its part of chi-square.
double noise(double square_sum, int freedom) { return freedom > 0 ? std::max(1.0, square_sum / freedom) : 1.0; }

}  // namespace

struct FaultSearch::Tested {
    std::unique_ptr<FaultHypotheses> hypotheses;
    std::unique_ptr<FaultTests> tests;
    double square_sum = 0.0;
    int freedom = 0;
    SolutionPointer at = nullptr;  // kept for the tests, where nobody else does

    double noise_beside(double gain) const { return noise(square_sum - gain, freedom - 1); }
    // Whether so many more faults leave a scatter that nobody believes: the worst is found first. One that hides behind
    // others may be larger than they.
    bool is_hopeless(double gain, int more) const {
        constexpr double hidden = 3.0;
        return square_sum - thresholds.largest_variance_factor() * freedom > hidden * gain * more;
    }
    // By falling gain.
    std::vector<int> order() const {
        std::vector<int> order;
        for (int h = 0; h < int(tests->scores().size()); ++h)
            if (tests->scores()[h].gain > 0.0) order.push_back(h);
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return tests->scores()[a].gain > tests->scores()[b].gain; });
        return order;
    }
    Candidate candidate(int h) const { return {hypotheses->all()[h], tests->scores()[h]}; }
};

FaultSearch::FaultSearch(const AdjustmentProblem& problem, const AdjustmentOptions& options,
                         const std::array<double, function_count>& smoothness)
    : problem_(problem), hypotheses_(problem), options_(options), smoothness_(smoothness) {
    constexpr double usual_tests = 1000.0;
    limit_ = options.outlier_probability > 0.0 ? gain_of_probability(options.outlier_probability / usual_tests)
                                               : thresholds.fault;
    most_ = std::max(10, int(problem.readings().size() / 50));
}

FaultSearch::SolutionPointer FaultSearch::run() {
    const bool corrects = options_.outlier_probability > 0.0;
    // A second's worth, where nobody will use what comes out.
    constexpr int least_soon = 40, work = 40'000, rough = 10;
    const int soon = std::clamp(work / problem_.size(), least_soon, GaussNewton::usual_most_steps);
    SolutionPointer plain = solution_of(handled()), solution;
    if (!options_.search_faults) return plain->solve_from_zero(soon) || plain->go_from_zero(rough) ? plain : nullptr;
    if (!plain->solve_from_zero()) plain.reset();
    if (corrects && (!plain || plain->scatter() > thresholds.gross_scatter)) solution = without_gross(plain);
    if (!solution) solution = plain;
    if (!solution) return nullptr;
    const bool corrected = corrects && correct(solution);
    if (corrected && found_.empty()) return solution;
    last_.reset();
    if (corrects && !corrected && plain) {
        // It is not a few readings that do not fit: all stay, and chi-square tells.
        found_.clear();
        solution = plain;
    }
    left_ = class_of(int(found_.size()), *solution);
    return solution;
}

// --- problems, with what was found in them ---

void FaultSearch::add_fault(std::vector<EstimatedFault>& faults, const Candidate& candidate, PriorUncertainty prior,
                            int group) const {
    faults.push_back({hypotheses_.pattern(candidate.hypothesis), prior, std::abs(candidate.score.size), group});
}

AdjustmentProblem FaultSearch::handled(int without, const Candidate* instead) const {
    AdjustmentProblem problem = problem_;
    std::vector<EstimatedFault> faults;
    for (int k = 0; k < int(found_.size()); ++k) {
        if (k == without) continue;
        for (const Candidate& member : found_[k].members) {
            if (member.is_name) continue;
            if (found_[k].handling == Handling::left_out) {
                for (const int r : hypotheses_.readings(member.hypothesis)) problem.readings()[r].outlier = k + 1;
                continue;
            }
            const bool known = found_[k].handling == Handling::shared && found_[k].alternatives() > 1;
            add_fault(faults, member, known ? std::abs(member.score.size) : free_unknown, k);
            if (found_[k].handling == Handling::representative) break;
        }
    }
    if (instead) add_fault(faults, *instead, free_unknown, int(found_.size()));
    problem.estimate(std::move(faults));
    return problem;
}

FaultSearch::SolutionPointer FaultSearch::solution_of(AdjustmentProblem problem) const {
    return std::make_shared<Solution>(std::move(problem), smoothness_);
}

// The unknowns of one problem in another one, with other faults.
Eigen::VectorXd FaultSearch::carried(const Solution& from, const AdjustmentProblem& to) const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(to.size());
    x.head(problem_.size()) = from.x().head(problem_.size());
    for (const EstimatedFault& fault : to.faults())
        for (const EstimatedFault& old : from.problem().faults())
            if (old.pattern == fault.pattern) x[fault.unknown] = from.x()[old.unknown];
    return x;
}

FaultSearch::SolutionPointer FaultSearch::solve_near(const Solution& solution) const {
    SolutionPointer next = solution_of(handled());
    if (next->solve_from(carried(solution, next->problem())) || next->solve_from_zero()) return next;
    return nullptr;
}

FaultSearch::Tested FaultSearch::test(Solution& solution, const Eigen::VectorXd& x) const {
    solution.linearise(x);
    const NormalEquations& equations = solution.solver().equations();
    Eigen::VectorXd dx = equations.gradient(x);
    solution.solver().factor().solve(dx);
    const Eigen::VectorXd residuals = equations.residuals() - equations.image(dx);
    Tested tested{std::make_unique<FaultHypotheses>(solution.problem()), nullptr,
                  equations.square_sum(residuals, x + dx), solution.degrees_of_freedom()};
    tested.tests = std::make_unique<FaultTests>(equations, solution.solver().factor(), solution.inverse(),
                                                solution.reading_variances(), *tested.hypotheses, residuals);
    return tested;
}

const FaultTests& FaultSearch::tests(Solution& solution) {
    const bool solved_again = options_.smoothness && options_.smoothness->cross_validated;
    if (!last_ || last_->at.get() != &solution || solved_again) {  // rounds may end at another solution
        auto hypotheses = std::make_unique<FaultHypotheses>(solution.problem());
        auto tests = std::make_unique<FaultTests>(solution.solver().equations(), solution.solver().factor(),
                                                  solution.inverse(), solution.reading_variances(), *hypotheses);
        last_ = std::make_shared<Tested>(Tested{std::move(hypotheses), std::move(tests)});
    }
    return *last_->tests;
}

std::optional<FaultSearch::Candidate> FaultSearch::worst(const Tested& tested) const {
    const std::vector<FaultScore>& scores = tested.tests->scores();
    const auto best = std::max_element(scores.begin(), scores.end(),
                                       [](const FaultScore& a, const FaultScore& b) { return a.gain < b.gain; });
    if (best == scores.end() || !(best->gain >= limit_ * tested.noise_beside(best->gain))) return std::nullopt;
    return tested.candidate(int(best - scores.begin()));
}

// --- what there is ---

// On the problem linearised at zero, and then where that leads. What second order leaves counts as scatter: faults are
// sought as far as they stand out of it.
FaultSearch::SolutionPointer FaultSearch::without_gross(const SolutionPointer& plain) {
    SolutionPointer solution;
    for (int pass = 0; pass < 2; ++pass) {
        const std::vector<Found> before = std::exchange(found_, {});
        SolutionPointer next = find_linearly(solution) ? solution_of(handled()) : nullptr;
        // Where that leaves as much, it is no faults of readings.
        if (next && !(next->solve_from_zero() && next->scatter() <= thresholds.gross_scatter)) next.reset();
        if (next && next->square_sum() < (solution ? solution : plain ? plain : next)->square_sum() * 1.01) {
            solution = next;
            continue;
        }
        found_ = before;
        if (!solution) return nullptr;
    }
    std::vector<Found> told;
    for (int k = 0; k < int(found_.size()); ++k)
        if (const auto found = class_of(k, *solution)) told.push_back({{found->members.front()}});
    std::swap(found_, told);
    if (SolutionPointer next = solve_near(*solution)) return next;
    std::swap(found_, told);
    return solution;
}

// Each with all that it may be instead, all of them free. False: there are none, or too many.
bool FaultSearch::find_linearly(const SolutionPointer& where) {
    const auto tested = [&](int without) {
        const SolutionPointer at = solution_of(handled(without));
        Tested result = test(*at, where ? carried(*where, at->problem()) : at->x());
        result.at = at;
        return result;
    };
    while (true) {
        const Tested rest = tested(-1);
        const auto next = worst(rest);
        if (!next) break;
        if (rest.is_hopeless(next->score.gain, most_ - int(found_.size()))) return false;
        found_.push_back({{*next}});
    }
    std::vector<Found> open;
    for (int k = 0; k < int(found_.size()); ++k) {
        const Tested rest = tested(k);
        if (!worst(rest)) continue;  // beside the others it is none
        const std::vector<int> order = rest.order();
        const double best = rest.tests->scores()[order.front()].gain;
        Found all{{}, Handling::open};
        for (const int h : order)
            if (all.members.size() < most_members &&
                best - rest.tests->scores()[h].gain < thresholds.alternative * rest.noise_beside(best))
                all.members.push_back(rest.candidate(h));
        open.push_back(std::move(all));
    }
    found_ = open;
    return !found_.empty();
}

// Corrects what there is, and says whether it could.
bool FaultSearch::correct(SolutionPointer& solution) {
    const int most_rounds = 5 + most_;
    for (int round = 0; round < most_rounds; ++round) {
        if (!find_more(solution)) return false;
        if (found_.empty()) return true;
        std::vector<Found> classes;
        std::vector<int> none;  // beside the others
        for (int k = 0; k < int(found_.size()); ++k) {
            auto found = class_of(k, *solution);
            if (found) classes.push_back(std::move(*found));
            else none.push_back(k);
        }
        if (!none.empty()) {
            const std::vector<Found> before = found_;
            found_.erase(found_.begin() + none.back());
            if (SolutionPointer next = solve_near(*solution)) {
                solution = next;
                continue;
            }
            found_ = before;
            return true;
        }
        const std::vector<Found> single = std::exchange(found_, classes);
        SolutionPointer treated = solve_treated(*solution);
        if (!treated) {
            found_ = single;
            return true;
        }
        const auto left = worst(test(*treated, treated->x()));
        if (!left || round + 1 == most_rounds || int(found_.size()) == most_) {
            solution = treated;
            return true;
        }
        found_ = single;
        found_.push_back({{*left}});
        SolutionPointer next = solve_near(*solution);
        if (!next) {
            found_ = classes;
            solution = treated;
            return true;
        }
        solution = next;
    }
    return true;
}

// One after the other, each as one more unknown. False: there are too many.
bool FaultSearch::find_more(SolutionPointer& solution) {
    for (int step = 0; step < 4 * most_; ++step) {
        explain_by_fewer(solution);
        last_ = std::make_shared<Tested>(test(*solution, solution->x()));
        last_->at = solution;
        const Tested& tested = *last_;
        const auto next = worst(tested);
        // A scatter that nobody believes and no fault explains: then the many that were found explain nothing either.
        constexpr std::size_t few = 5;
        if (!next) return found_.size() <= few || tested.noise_beside(0.0) <= thresholds.largest_variance_factor();
        if (tested.is_hopeless(next->score.gain, most_ - int(found_.size()))) return false;
        if (int(found_.size()) == most_) return false;
        const std::vector<Found> before = found_;
        found_.push_back({{*next}});
        SolutionPointer more = solve_near(*solution);
        if (!more) {
            const auto found = class_of(int(before.size()), *solution);
            if (found) found_.back() = {{found->members.front()}};
            if (found) more = solve_near(*solution);
        }
        if (more && drop_or_exchange(*more)) more = solve_near(*more);
        if (!more) {
            found_ = before;
            return true;
        }
        solution = more;
    }
    return false;
}

// Beside those that were found later, an earlier one may be none, or another one.
bool FaultSearch::drop_or_exchange(const Solution& solution) {
    constexpr std::size_t few = 10;
    if (found_.size() < 2 || found_.size() > few) return false;
    bool changed = false;
    for (int k = 0; k + 1 < int(found_.size()); ++k) {
        SolutionPointer rest = solution_of(handled(k));
        const Tested tested = test(*rest, carried(solution, rest->problem()));
        const auto best = worst(tested);
        if (!best) {
            found_.erase(found_.begin() + k--);
            changed = true;
            continue;
        }
        const FaultHypothesis own = tested.hypotheses->as_tested(found_[k].members.front().hypothesis);
        double gain = 0.0;
        for (std::size_t h = 0; h < tested.hypotheses->all().size(); ++h)
            if (tested.hypotheses->all()[h] == own) gain = tested.tests->scores()[h].gain;
        if (best->score.gain - gain < thresholds.alternative * tested.noise_beside(best->score.gain)) continue;
        found_[k] = {{*best}};
        changed = true;
    }
    return changed;
}

// A tilt's first reading that is wrong, and a slip after it, are the same to first order; what second order makes of
// the one that did not happen looks like a fault of distances. So each is tried with one fault less.
void FaultSearch::explain_by_fewer(SolutionPointer& solution) {
    for (std::size_t k = 0; k < found_.size(); ++k) {
        const Candidate own = found_[k].members.front();
        const FaultHypothesis tested = hypotheses_.as_tested(own.hypothesis);
        if (own.score.gain < thresholds.second_order || !hypotheses_.differs_from_slip(tested)) continue;
        Candidate other = own;
        other.hypothesis = own.hypothesis == tested ? *hypotheses_.as_slip(tested) : tested;
        other.score.size = -own.score.size;
        for (std::size_t j = 0; j < found_.size(); ++j) {
            if (j == k) continue;
            const std::vector<Found> before = found_;
            found_[k] = {{other}};
            found_.erase(found_.begin() + int(j));
            SolutionPointer next = solve_near(*solution);
            const double enough = limit_ * noise(solution->square_sum(), solution->degrees_of_freedom());
            if (next && next->square_sum() < solution->square_sum() + enough) {
                solution = next;
                return explain_by_fewer(solution);
            }
            found_ = before;
        }
    }
}

// Beside a tilt's first reading that may be wrong the slip that second order may tell from it.
void FaultSearch::add_slips(std::vector<Candidate>& candidates) const {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        if (!hypotheses_.differs_from_slip(candidates[i].hypothesis)) continue;
        Candidate slip{*hypotheses_.as_slip(candidates[i].hypothesis), candidates[i].score};
        slip.score.size = -slip.score.size;
        candidates.insert(candidates.begin() + int(++i), slip);
    }
}

// Beside a first reading that may be wrong the slip that it may be named as, where nothing tells them apart.
void FaultSearch::add_names(std::vector<Candidate>& members, bool large) const {
    for (std::size_t i = 0; i < members.size(); ++i) {
        const auto slip = hypotheses_.as_slip(members[i].hypothesis);
        if (!slip || (large && hypotheses_.differs_from_slip(members[i].hypothesis))) continue;
        Candidate name{*slip, members[i].score, true};
        name.score.size = -name.score.size;
        members.insert(members.begin() + int(++i), name);
    }
}

// The class of a fault, were it the only one that is not known: on the problem linearised at the solution, and by exact
// adjustments where it is so large that second order may tell.
std::optional<FaultSearch::Found> FaultSearch::class_of(int number, const Solution& solution) const {
    constexpr double second_order = 0.02;  // of a large gain
    SolutionPointer rest = solution_of(handled(number));
    const Tested tested = test(*rest, carried(solution, rest->problem()));
    if (!worst(tested)) return std::nullopt;
    const std::vector<int> order = tested.order();
    const double best = tested.tests->scores()[order.front()].gain;
    const double behind = thresholds.alternative * tested.noise_beside(best);
    std::vector<Candidate> members;
    for (const int h : order) {
        const double less = best - tested.tests->scores()[h].gain;
        const bool may_be =
            best > thresholds.second_order && members.size() < most_exact && less < behind + second_order * best;
        if (members.size() < most_members && (less < behind || may_be)) members.push_back(tested.candidate(h));
    }
    if (best > thresholds.second_order && tested.noise_beside(best) <= thresholds.largest_variance_factor()) {
        add_slips(members);
        adjust_exactly(members, number, solution);
        const std::vector<Candidate> twins = with_twins(members, tested);
        if (is_told_by_leaving_out(twins, tested)) members = twins;
    }
    Found found{members, is_told_by_leaving_out(members, tested) ? Handling::left_out : Handling::shared};
    add_names(found.members, best > thresholds.second_order);
    return found;
}

void FaultSearch::adjust_exactly(std::vector<Candidate>& candidates, int number, const Solution& solution) const {
    const double best = candidates.front().score.gain;
    double least = infinity, gain_of_least = best;
    int freedom = 0;
    std::vector<double> square_sum;
    for (std::size_t i = 0; i < candidates.size() && i < most_exact; ++i) {
        SolutionPointer with = solution_of(handled(number, &candidates[i]));
        square_sum.push_back(infinity);
        if (!with->solve_from(carried(solution, with->problem()))) continue;
        square_sum.back() = with->square_sum();
        candidates[i].score.size = with->x()[with->problem().faults().back().unknown];
        if (square_sum.back() >= least) continue;
        least = square_sum.back();
        gain_of_least = candidates[i].score.gain;
        freedom = with->degrees_of_freedom();
    }
    if (least == infinity) return;
    const double behind = thresholds.alternative * noise(least, freedom);
    for (std::size_t i = 0; i < square_sum.size(); ++i)
        candidates[i].score.gain = gain_of_least + least - square_sum[i];
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [&](const Candidate& c) { return !(gain_of_least - c.score.gain < behind); }),
                     candidates.end());
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score.gain > b.score.gain; });
}

// Where second order tells the large fault of a reading from those of its twins, no reading controls these any more.
std::vector<FaultSearch::Candidate> FaultSearch::with_twins(std::vector<Candidate> members,
                                                            const Tested& tested) const {
    const auto& all = tested.hypotheses->all();
    const auto best = std::find(all.begin(), all.end(), members.front().hypothesis);
    if (best == all.end() || best->kind != FaultKind::reading) return members;
    const std::vector<double> correlation = tested.tests->correlations(int(best - all.begin()));
    for (std::size_t h = 0; h < all.size(); ++h) {
        const auto is_this = [&](const Candidate& member) { return member.hypothesis == all[h]; };
        if (all[h].kind != FaultKind::reading || std::abs(correlation[h]) < twin) continue;
        if (std::none_of(members.begin(), members.end(), is_this)) members.push_back(tested.candidate(int(h)));
    }
    return members;
}

// Readings that show the same in all others: without them nothing is left of the fault. One of the two of a scale line
// takes the other with it.
bool FaultSearch::is_told_by_leaving_out(const std::vector<Candidate>& members, const Tested& tested) const {
    std::vector<int> number;
    for (const Candidate& member : members) {
        if (member.hypothesis.kind != FaultKind::reading) return false;
        if (hypotheses_.sequences()[member.hypothesis.sequence].readings.size() < 3) return false;
        const auto& all = tested.hypotheses->all();
        number.push_back(int(std::find(all.begin(), all.end(), member.hypothesis) - all.begin()));
    }
    for (std::size_t i = 0; i + 1 < number.size(); ++i) {
        const std::vector<double> correlation = tested.tests->correlations(number[i]);
        for (std::size_t j = i + 1; j < number.size(); ++j)
            if (std::abs(correlation[number[j]]) < twin) return false;
    }
    return true;
}

FaultSearch::SolutionPointer FaultSearch::solve_treated(const Solution& solution) {
    // With one of each class as a free unknown it was this; as one of several known to be about as large it costs 1.
    const double expected = 1.01 * solution.square_sum() + 2.0 * double(found_.size());
    const auto solve = [&]() -> SolutionPointer {
        // From zero where that leads as far: as if the readings left out had been lost.
        for (const bool from_zero : {true, false}) {
            SolutionPointer next = solution_of(handled());
            if ((from_zero ? next->solve_from_zero() : next->solve_from(carried(solution, next->problem()))) &&
                next->square_sum() <= expected)
                return next;
        }
        return nullptr;
    };
    if (SolutionPointer next = solve()) return next;
    // Gross alternatives that no one solution stands between: all of them are free then.
    for (Found& found : found_)
        if (found.handling == Handling::shared) found.handling = Handling::open;
    return solve();
}

// --- what is said ---

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

}  // namespace

std::vector<FaultClass> FaultSearch::classes(const Solution& solution, const CalibratedForms& forms,
                                             const Measurement& measurement) const {
    std::vector<FaultClass> classes;
    const auto add = [&](const Found& found, FaultTreatment treatment) -> FaultClass& {
        FaultClass entry{{}, treatment};
        for (const Candidate& member : found.members) {
            const AdjustedReading& reading = problem_.readings()[*hypotheses_.readings(member.hypothesis).begin()];
            const Station& station = measurement.stations()[reading.row];
            entry.members.push_back({member.hypothesis.kind, reading.row, station.run, station.line.name(),
                                     station.point, problem_.channel_name(reading), member.score.size,
                                     member.score.standard_uncertainty, member.score.gain});
        }
        return classes.emplace_back(std::move(entry));
    };
    const std::vector<Value> values = values_of(forms, problem_.plan(), options_.plausible);
    for (int k = 0; k < int(found_.size()); ++k) {
        const Found& found = found_[k];
        const bool left_out = found.handling == Handling::left_out;
        FaultClass& entry = add(found, left_out ? FaultTreatment::left_out : FaultTreatment::estimated);
        entry.corrected = options_.slips == Slips::estimate ||
                          std::any_of(found.members.begin(), found.members.end(), [](const Candidate& member) {
                              return member.hypothesis.kind == FaultKind::reading;
                          });
        if (left_out || found.alternatives() < 2) continue;
        const SolutionPointer rest = solution_of(handled(k));
        const Tested tested = test(*rest, carried(solution, rest->problem()));
        std::vector<Eigen::VectorXd> effects;  // of what each has done
        for (const Candidate& member : found.members)
            if (!member.is_name) effects.push_back(member.score.size * tested.tests->effect(member.hypothesis));
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
    // Several slips that are not told apart may be other pairs than these: no class says so.
    const auto is_doubtful = [](const FaultClass& entry) {
        return !entry.told_apart() && std::none_of(entry.members.begin(), entry.members.end(),
                                                   [](const Fault& fault) { return fault.kind == FaultKind::reading; });
    };
    if (std::count_if(classes.begin(), classes.end(), is_doubtful) > 1)
        for (FaultClass& entry : classes)
            if (is_doubtful(entry)) entry.corrected = false;
    if (left_) add(*left_, FaultTreatment::none);
    return classes;
}

}  // namespace stepdiag
