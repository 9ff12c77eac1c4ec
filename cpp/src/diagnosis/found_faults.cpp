#include "diagnosis/found_faults.hpp"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>
#include <utility>

namespace stepdiag {
namespace {

// Two-sided, squared: 28 for a probability of 1.2e-7.
double gain_of_probability(double probability) { return std::pow(Eigen::numext::ndtri(0.5 * probability), 2); }

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
                           const std::array<double, function_count>& deviations)
    : problem(of_all),
      hypotheses(of_all),
      options(given),
      smoothness(deviations),
      limit(given.outlier_probability > 0.0
                ? gain_of_probability(given.outlier_probability / search_limits::usual_tests)
                : thresholds.fault),
      most(std::max(search_limits::most_faults, int(of_all.readings().size()) / search_limits::readings_a_fault)) {}

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
