#include "diagnosis/found_faults.hpp"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>
#include <utility>

namespace stepdiag {
namespace {

// Two-sided, squared: 28 for a probability of 1.2e-7.
double gain_of_probability(double probability) { return std::pow(Eigen::numext::ndtri(0.5 * probability), 2); }

// A part of the redundancy of each channel. N faults of which each is seen beside the others need N redundant readings,
// and what is found by chance grows with them.
std::map<std::string, int> most_faults(const AdjustmentProblem& problem, Solution& solution) {
    solution.linearise(solution.x());
    std::map<std::string, double> redundancy;
    for (std::size_t r = 0; r < problem.readings().size(); ++r)
        redundancy[problem.noise_channel(problem.readings()[r])] += 1.0 - solution.reading_variances()[Eigen::Index(r)];
    std::map<std::string, int> most;
    for (const auto& [channel, sum] : redundancy) most[channel] = std::max(1, int(thresholds.most_faults * sum));
    return most;
}

}  // namespace

FoundFaults with(FoundFaults found, const FaultCandidate& one_more) {
    found.push_back({{one_more}});
    return found;
}

FoundFaults without(FoundFaults found, int k) {
    found.erase(found.begin() + k);
    return found;
}

std::vector<int> TestedFaults::order() const {
    const std::vector<FaultScore>& scores = tests->scores();
    std::vector<int> order;
    for (int h = 0; h < int(scores.size()); ++h)
        if (scores[h].gain > 0.0) order.push_back(h);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return scores[a].gain > scores[b].gain; });
    return order;
}

double TestedFaults::gain_of(const FaultHypothesis& hypothesis) const {
    const auto& all = hypotheses->all();
    const auto found = std::find(all.begin(), all.end(), hypothesis);
    return found == all.end() ? 0.0 : tests->scores()[std::size_t(found - all.begin())].gain;
}

FaultContext::FaultContext(const AdjustmentProblem& of_all, const AdjustmentOptions& given,
                           const std::array<double, function_count>& deviations, SolutionPointer of_none)
    : problem(of_all),
      hypotheses(of_all),
      options(given),
      smoothness(deviations),
      all(std::move(of_none)),
      limit(given.outlier_probability > 0.0
                ? gain_of_probability(given.outlier_probability / search_limits::usual_tests)
                : thresholds.fault) {}

// At zero: where gross readings lead, redundancies are others.
const std::map<std::string, int>& FaultContext::most() const {
    if (most_.empty()) most_ = most_faults(problem, *unsolved({}));
    return most_;
}

std::string FaultContext::channel(const FaultCandidate& candidate) const {
    return problem.noise_channel(problem.readings()[std::size_t(*hypotheses.readings(candidate.hypothesis).begin())]);
}

int FaultContext::left_of(const std::string& name, const FoundFaults& found) const {
    return most().at(name) - int(std::count_if(found.begin(), found.end(), [&](const FoundFault& fault) {
               return channel(fault.members.front()) == name;
           }));
}

int FaultContext::left_of_all(const FoundFaults& found) const {
    int left = 0;
    for (const auto& of : most()) left += std::max(0, left_of(of.first, found));
    return left;
}

bool FaultContext::are_too_many(const FoundFaults& found) const {
    return std::any_of(most().begin(), most().end(), [&](const auto& of) { return left_of(of.first, found) < 0; });
}

FaultContext::SolutionPointer FaultContext::unsolved(const FoundFaults& found) const {
    AdjustmentProblem with_them = problem;
    std::vector<EstimatedFault> faults;
    for (int k = 0; k < int(found.size()); ++k) {
        const FaultHandling handling = found[k].handling;
        for (const FaultCandidate& member : found[k].members) {
            if (member.is_name) continue;
            if (handling == FaultHandling::left_out) {
                for (const int r : hypotheses.readings(member.hypothesis)) with_them.readings()[r].outlier = k + 1;
                continue;
            }
            const double size = std::abs(member.score.size);
            const bool known = handling == FaultHandling::shared && found[k].alternatives() > 1;
            faults.push_back({hypotheses.pattern(member.hypothesis), known ? size : free_unknown, size, k});
            if (handling == FaultHandling::representative) break;
        }
    }
    with_them.estimate(std::move(faults));
    return std::make_shared<Solution>(std::move(with_them), smoothness);
}

Eigen::VectorXd FaultContext::carried(const Solution& from, const AdjustmentProblem& to) const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(to.size());
    x.head(problem.size()) = from.x().head(problem.size());
    for (const EstimatedFault& fault : to.faults())
        for (const EstimatedFault& old : from.problem().faults())
            if (old.pattern == fault.pattern) x[fault.unknown] = from.x()[old.unknown];
    return x;
}

FaultContext::SolutionPointer FaultContext::solve_near(const FoundFaults& found, const Solution& from) const {
    SolutionPointer next = unsolved(found);
    if (next->solve_from(carried(from, next->problem())) || next->solve_from_zero()) return next;
    return nullptr;
}

TestedFaults FaultContext::test(const SolutionPointer& at, const Eigen::VectorXd& x) const {
    Solution& solution = *at;
    solution.linearise(x);
    const NormalEquations& equations = solution.solver().equations();
    Eigen::VectorXd dx = equations.gradient(x);
    solution.solver().factor().solve(dx);
    const Eigen::VectorXd residuals = equations.residuals() - equations.image(dx);
    TestedFaults tested{at, std::make_unique<FaultHypotheses>(solution.problem()), nullptr,
                        equations.square_sum(residuals, x + dx), solution.degrees_of_freedom()};
    tested.tests = std::make_unique<FaultTests>(equations, solution.solver().factor(), solution.inverse(),
                                                solution.reading_variances(), *tested.hypotheses, residuals);
    return tested;
}

TestedFaults FaultContext::test_near(const FoundFaults& found, const Solution& where) const {
    const SolutionPointer at = unsolved(found);
    return test(at, carried(where, at->problem()));
}

std::optional<FaultCandidate> FaultContext::worst(const TestedFaults& tested) const {
    const std::vector<FaultScore>& scores = tested.tests->scores();
    const auto best = std::max_element(scores.begin(), scores.end(),
                                       [](const FaultScore& a, const FaultScore& b) { return a.gain < b.gain; });
    if (best == scores.end() || !(best->gain >= limit * tested.noise_beside(best->gain))) return std::nullopt;
    return tested.candidate(int(best - scores.begin()));
}

}  // namespace stepdiag
