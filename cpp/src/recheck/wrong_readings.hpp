// Readings that do not go with what is known, because some of them are wrong: they are found, left out, and the rest is
// judged. Internal: not installed.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "recheck/prediction.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/thresholds.hpp"

namespace stepdiag {

// Where readings are less probable by what is known, it is asked whether they are wrong.
inline constexpr double readings_asked_below = 1e-2;

struct Misfit {
    int reading;
    double value;  // read - predicted, mm or rad
    double standard_uncertainty;

    double by_uncertainty() const { return standard_uncertainty > 0.0 ? value / standard_uncertainty : 0.0; }
};
// Those that are farthest by their uncertainties, the worst first.
std::vector<Misfit> largest_misfits(const AdjustmentProblem& problem, const Prediction& prediction, std::size_t count);

// What readings are judged by, and with.
struct Run {
    const Measurement& measurement;
    const Plan& plan;
    const Chain& chain;
    const Eigen::Vector3d& tool;
    const HeadCalibrations& heads;
    const AdjustmentOptions& options;
};

// The faults that an adjustment of the run by itself finds, with a machine that is not known: a change of the machine
// is none of them. None where there is no such adjustment.
std::vector<FaultClass> faults_of(const Run& run);  // as they are left out

// Leaves out the readings that the faults may have spoilt: of a slip those of its channel from there on, of a factor
// all on its line. Where a slip may as well be a single reading, leaving that out removes the slip, too.
void leave_out(const std::vector<FaultClass>& faults, AdjustmentProblem& problem);

// A wrong reading that is left out, from the judgement before and after.
Fault wrong_reading(const Run& run, const AdjustmentProblem& problem, const Misfit& before, double after, double gain);

[[noreturn]] void refuse_few_readings();

template <class Result>
struct Judgement {
    Result result;
    ChiSquare fit;
    double probability;  // of the fit
    bool is_asked;       // whether readings may be wrong
    // If the readings do not fit: the largest misfits where the machine may have changed, which leaves the least of
    // what is not wrong, and the square sum there.
    std::vector<Misfit> misfits;
    double square_sum;
    std::vector<double> missed;  // by reading: Prediction::missed
};

// judge(problem): a Judgement of the readings that are not left out. Leaves out a single reading without which the rest
// goes with what is known, and all others without which it does, too. Whether there is one.
template <class Judge, class Judged>
bool leave_out_one(const Run& run, AdjustmentProblem& problem, const Judge& judge, Judged& judged,
                   std::vector<FaultClass>& found) {
    constexpr double next_to_the_worst = 0.5, least_share = 0.5;
    FaultClass wrong{{}, FaultTreatment::left_out, true};
    std::vector<int> without;
    for (const Misfit& misfit : judged.misfits) {
        const double explains = std::pow(misfit.by_uncertainty(), 2);  // of the square sum, if that is a quadratic
        if (explains < next_to_the_worst * std::pow(judged.misfits[0].by_uncertainty(), 2) ||
            explains < least_share * judged.square_sum - judged.fit.freedom)
            break;
        problem.readings()[misfit.reading].outlier = int(found.size()) + 1;
        const auto rest = judge(problem);
        problem.readings()[misfit.reading].outlier = 0;
        const double gain = judged.fit.square_sum - rest.fit.square_sum;
        if (rest.fit.freedom < 1 || rest.probability < readings_asked_below || gain < thresholds.fault) continue;
        wrong.members.push_back(wrong_reading(run, problem, misfit, rest.missed[misfit.reading], gain));
        without.push_back(misfit.reading);
    }
    if (without.empty()) return false;
    for (const int reading : without) problem.readings()[reading].outlier = int(found.size()) + 1;
    auto rest = judge(problem);
    if (rest.fit.freedom < 1) {
        for (const int reading : without) problem.readings()[reading].outlier = 0;
        return false;
    }
    judged = std::move(rest);
    found.push_back(std::move(wrong));
    return true;
}

// The same for any number of faults. What is known distinguishes single readings better than the run by itself does; of
// all else the run's own faults are left out, and then perhaps one more reading.
template <class Judge>
auto judge_without_wrong_readings(const Run& run, AdjustmentProblem& problem, const Judge& judge) {
    auto judged = judge(problem);
    if (judged.fit.freedom < 1) refuse_few_readings();
    std::vector<FaultClass> found;
    if (judged.is_asked && !leave_out_one(run, problem, judge, judged, found)) {
        found = faults_of(run);
        leave_out(found, problem);
        if (!found.empty()) {
            auto rest = judge(problem);
            if (rest.fit.freedom < 1) {
                found.clear();
            } else {
                judged = std::move(rest);
                leave_out_one(run, problem, judge, judged, found);
            }
        }
    }
    judged.result.left_out = std::move(found);
    return judged.result;
}

}  // namespace stepdiag
