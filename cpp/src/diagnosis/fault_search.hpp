// The search for faults of the readings, and what is done about them. Internal: not installed.
// Faults are found one after the other, each as one more free unknown: the one that takes most off chi-square, as long
// as that is significant; what is no longer significant beside the others is dropped. Then each gets its class: all
// hypotheses whose gain is less than 25 behind that of the best, by exact adjustments of the best 20. The classes are
// treated (FaultTreatment), everything is adjusted anew, and tested again.
// Where Gauss-Newton fails, or settles where readings scatter far too much, the search begins on the problem
// linearised at zero, which has one minimum whatever the readings are; there and then all of a class are free, so that
// no gross value is left in the problem. What it takes is that a fault is controlled: N faults of which each is seen
// beside the others need as many redundant directions. So a channel has at most a tenth as many as its redundancy, and
// at least one; more are no faults of readings. The standard plan has one a step among the distances of the body
// diagonals, five among the tilts, and one among the scale lines.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adjustment/adjustment_result.hpp"
#include "adjustment/solution.hpp"
#include "diagnosis/fault_tests.hpp"

namespace stepdiag {

class FaultSearch {
public:
    // `smoothness`: as of GaussNewton.
    FaultSearch(const AdjustmentProblem& problem, const AdjustmentOptions& options,
                const std::array<double, function_count>& smoothness);

    const AdjustmentProblem& problem() const { return problem_; }  // with nothing left out or freed

    // The adjustment with what was done about the faults; none where no minimum is reached. `plain`: the problem's own
    // solution; none where its minimum is not reached.
    std::shared_ptr<Solution> run(std::shared_ptr<Solution> plain);
    // What was found by then. `forms`: of which alternatives are compared.
    std::vector<FaultClass> classes(const Solution& solution, const CalibratedForms& forms,
                                    const Measurement& measurement) const;

    // At the adjustment that came out, as it is now.
    const FaultTests& tests(Solution& solution);

private:
    struct Candidate {
        FaultHypothesis hypothesis;
        FaultScore score;
        bool is_name = false;  // another one of the member before, and nothing of its own
    };
    // How the members of a class are taken while the search goes on.
    enum class Handling {
        representative,  // the first is a free unknown
        open,            // all are
        left_out,        // all their readings are
        shared           // all are unknowns with priors
    };
    struct Found {
        std::vector<Candidate> members;  // the best first
        Handling handling = Handling::representative;

        auto alternatives() const {
            return std::count_if(members.begin(), members.end(), [](const Candidate& c) { return !c.is_name; });
        }
    };
    // The tests on the problem linearised somewhere, at its minimum there.
    struct Tested;
    using SolutionPointer = std::shared_ptr<Solution>;

    // With what was found, but for one class, or with a fault in its place.
    AdjustmentProblem handled(int without = -1, const Candidate* instead = nullptr) const;
    void add_fault(std::vector<EstimatedFault>& faults, const Candidate& candidate, PriorUncertainty prior,
                   int group) const;
    SolutionPointer solution_of(AdjustmentProblem problem) const;
    SolutionPointer solve_near(const Solution& solution) const;  // none where it fails
    SolutionPointer solve_treated(const Solution& solution);     // likewise
    Eigen::VectorXd carried(const Solution& from, const AdjustmentProblem& to) const;
    Tested test(Solution& solution, const Eigen::VectorXd& x) const;
    std::optional<Candidate> worst(const Tested& tested) const;  // if it is significant
    void limit_faults(const SolutionPointer& plain);
    std::string channel(const Candidate& candidate) const;
    int left_of(const std::string& channel) const;  // how many more faults it may have
    int left_of_all() const;
    bool are_too_many() const;

    SolutionPointer without_gross(const SolutionPointer& plain);  // none where that helps nothing
    bool find_linearly(const SolutionPointer& where);             // at zero where there is no solution yet
    bool correct(SolutionPointer& solution);
    bool find_more(SolutionPointer& solution);
    bool drop_or_exchange(const Solution& solution);
    void explain_by_fewer(SolutionPointer& solution);
    void add_slips(std::vector<Candidate>& candidates) const;
    void add_names(std::vector<Candidate>& members, bool large) const;
    // None where that is not significant.
    std::optional<Found> class_of(int number, const Solution& solution) const;
    void adjust_exactly(std::vector<Candidate>& candidates, int number, const Solution& solution) const;
    std::vector<Candidate> with_twins(std::vector<Candidate> members, const Tested& tested) const;
    bool is_told_by_leaving_out(const std::vector<Candidate>& members, const Tested& tested) const;

    AdjustmentProblem problem_;
    FaultHypotheses hypotheses_;  // of all readings: their sequences
    AdjustmentOptions options_;
    std::array<double, function_count> smoothness_;
    double limit_;
    std::map<std::string, int> most_;  // by noise channel
    std::vector<Found> found_;
    std::optional<Found> left_;     // what was found and nothing was done about
    std::shared_ptr<Tested> last_;  // of a run without faults
};

}  // namespace stepdiag
