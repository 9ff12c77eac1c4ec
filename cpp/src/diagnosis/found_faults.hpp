// Faults that were found, the problem with them, and its tests. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adjustment/solution.hpp"
#include "diagnosis/fault_tests.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {

// What the search decides by beside `thresholds`: work that is worth it, and what second order leaves uncertain.
namespace search_limits {
// The outlier probability (AdjustmentOptions) is of a false alarm among so many tests: those of a run of 20 steps.
inline constexpr double usual_tests = 1000.0;
// Faults of a channel on the way, beside those that it may have: several readings may turn out to be one slip.
inline constexpr int more_on_the_way = 5;
// Steps of a search of at most n faults, each found, exchanged and found again some times; and rounds of treatment.
inline constexpr int steps_a_fault = 4, rounds_more = 5;
// The worst fault is found first; one that hides behind others may be larger than they, in gain.
inline constexpr double hidden = 3.0;
// So few faults are believed where nothing explains the scatter that is left; of more that were found in it none is.
inline constexpr int few = 5;
// Of so many each may be none, or another one, beside those found later: it costs a factorisation each.
inline constexpr std::size_t most_revised = 10;
// Correlation of faults that show the same in all other readings.
inline constexpr double twin = 0.99;
// The part of a large gain that second order may make: what is as near to the best is adjusted exactly.
inline constexpr double second_order_part = 0.02;
inline constexpr std::size_t most_exact = 20;    // exact adjustments of a class
inline constexpr std::size_t most_members = 40;  // of a class: they are near enough to what is behind them
// Two minima with square sums as near as this are the same, to what second order leaves.
inline constexpr double same_minimum = 1.01;
// What a fault costs as one of several known to be about as large, in place of a free one: 1, and a margin.
inline constexpr double treated_cost = 2.0;
}  // namespace search_limits

struct FaultCandidate {
    FaultHypothesis hypothesis;
    FaultScore score;
    bool is_name = false;  // another one of the member before, and nothing of its own
};

// How the members of a class are taken.
enum class FaultHandling {
    representative,  // the first is a free unknown
    open,            // all are
    left_out,        // all their readings are
    shared           // all are unknowns with priors
};

struct FoundFault {
    std::vector<FaultCandidate> members;  // the best first
    FaultHandling handling = FaultHandling::representative;

    auto alternatives() const {
        return std::count_if(members.begin(), members.end(), [](const FaultCandidate& c) { return !c.is_name; });
    }
};
using FoundFaults = std::vector<FoundFault>;

FoundFaults with(FoundFaults found, const FaultCandidate& one_more);  // as a free unknown
FoundFaults without(FoundFaults found, int k);

// How much larger than stated the scatter is.
inline double scatter_factor(double square_sum, int freedom) {
    return freedom > 0 ? std::max(1.0, square_sum / freedom) : 1.0;
}

// The tests on a problem linearised somewhere, at its minimum there.
struct TestedFaults {
    std::shared_ptr<Solution> at;
    std::unique_ptr<FaultHypotheses> hypotheses;
    std::unique_ptr<FaultTests> tests = {};
    double square_sum = 0.0;
    int freedom = 0;

    double noise_beside(double gain) const { return scatter_factor(square_sum - gain, freedom - 1); }
    // Whether so many more faults leave a scatter that nobody believes.
    bool is_hopeless(double gain, int more) const {
        return square_sum - thresholds.largest_variance_factor() * freedom > search_limits::hidden * gain * more;
    }
    std::vector<int> order() const;  // by falling gain
    // How much less than that of the best the gain of its alternatives is at most.
    double behind(double best) const { return thresholds.alternative * noise_beside(best); }
    FaultCandidate candidate(int h) const { return {hypotheses->all()[h], tests->scores()[h]}; }
    double gain_of(const FaultHypothesis& hypothesis) const;  // 0 where there is none such
};

// What stays while faults are sought: the problem without them and what may be wrong with its readings. Problem and
// options must outlive it.
struct FaultContext {
    using SolutionPointer = std::shared_ptr<Solution>;

    // `smoothness`: as of GaussNewton. `all`: the solution without faults; none where no minimum is reached.
    FaultContext(const AdjustmentProblem& problem, const AdjustmentOptions& options,
                 const std::array<double, function_count>& smoothness, SolutionPointer all);

    SolutionPointer unsolved(const FoundFaults& found) const;
    // The unknowns of one problem in another one, with other faults.
    Eigen::VectorXd carried(const Solution& from, const AdjustmentProblem& to) const;
    // From there or from zero; none where both fail.
    SolutionPointer solve_near(const FoundFaults& found, const Solution& from) const;

    // Changes where `at` is linearised.
    TestedFaults test(const SolutionPointer& at, const Eigen::VectorXd& x) const;
    TestedFaults test(const SolutionPointer& at) const { return test(at, at->x()); }
    // With these faults, linearised where the solution of others is.
    TestedFaults test_near(const FoundFaults& found, const Solution& where) const;
    std::optional<FaultCandidate> worst(const TestedFaults& tested) const;  // if it is significant

    const AdjustmentProblem& problem;
    const FaultHypotheses hypotheses;  // of all readings: their sequences
    const AdjustmentOptions& options;
    const std::array<double, function_count> smoothness;
    const SolutionPointer all;
    const double limit;  // least gain of a fault

    const std::map<std::string, int>& most() const;  // faults of each channel
    int most_of_all() const { return left_of_all({}); }
    std::string channel(const FaultCandidate& candidate) const;
    // How many more faults a channel, or all of them, may have beside these; below 0 where there are more already.
    int left_of(const std::string& channel, const FoundFaults& found) const;
    int left_of_all(const FoundFaults& found) const;
    bool are_too_many(const FoundFaults& found) const;

private:
    mutable std::map<std::string, int> most_;  // made when it is asked for: sound runs do without
};

}  // namespace stepdiag
