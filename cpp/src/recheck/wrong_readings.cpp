#include "recheck/wrong_readings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "stepdiag/diagnosis/adjust.hpp"

namespace stepdiag {

void refuse_few_readings() {
    throw InvalidArgument("readings: there are no more of them than unknowns of how head and mirror stood");
}

std::vector<Misfit> largest_misfits(const AdjustmentProblem& problem, const Prediction& prediction, std::size_t count) {
    std::vector<Misfit> misfits;
    for (int r = 0; r < int(problem.readings().size()); ++r)
        if (problem.readings()[r].used()) {
            const auto [value, uncertainty] = prediction.misfit(r);
            misfits.push_back({r, value, uncertainty});
        }
    count = std::min(count, misfits.size());
    std::partial_sort(
        misfits.begin(), misfits.begin() + std::ptrdiff_t(count), misfits.end(),
        [](const Misfit& a, const Misfit& b) { return std::abs(a.by_uncertainty()) > std::abs(b.by_uncertainty()); });
    misfits.resize(count);
    return misfits;
}

std::vector<FaultClass> faults_of(const Run& run) {
    try {
        std::vector<FaultClass> faults =
            adjust(run.measurement, run.plan, run.chain, run.tool, run.heads, run.options).faults;
        for (FaultClass& one : faults) one.treatment = FaultTreatment::left_out;
        return faults;
    } catch (const InvalidArgument&) {
        return {};  // a short run may tell too little of a machine
    }
}

void leave_out(const std::vector<FaultClass>& faults, AdjustmentProblem& problem) {
    // In the order in which the readings of a set-up were made.
    using Place = std::pair<double, std::size_t>;  // time and row
    std::map<std::size_t, std::pair<int, Place>> of_row;
    for (const AdjustedPoint& point : problem.points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const std::size_t row = problem.readings()[r].row;
            of_row[row] = {point.setup, Place(point.place.time, row)};
        }
    for (std::size_t k = 0; k < faults.size(); ++k) {
        const std::vector<Fault>& members = faults[k].members;
        const bool is_reading = std::any_of(members.begin(), members.end(),
                                            [](const Fault& fault) { return fault.kind == FaultKind::reading; });
        for (const Fault& fault : members) {
            if (is_reading && fault.kind != FaultKind::reading) continue;
            const auto& [setup, begin] = of_row.at(fault.row);
            for (AdjustedReading& reading : problem.readings()) {
                const auto& [its_setup, place] = of_row.at(reading.row);
                const bool is_hit = fault.kind == FaultKind::reading ? reading.row == fault.row
                                    : its_setup != setup             ? false
                                    : fault.kind == FaultKind::slip  ? place >= begin
                                                                     : true;
                if (is_hit && problem.channel_name(reading) == fault.channel) reading.outlier = int(k) + 1;
            }
        }
    }
}

Fault wrong_reading(const Run& run, const AdjustmentProblem& problem, const Misfit& before, double after, double gain) {
    const AdjustedReading& reading = problem.readings()[before.reading];
    const Station& station = run.measurement.stations()[reading.row];
    const double own = reading.standard_uncertainty;
    const double uncertainty = own * own / before.standard_uncertainty;
    return {FaultKind::reading,
            reading.row,
            station.run,
            station.line.name(),
            station.point,
            problem.channel_name(reading),
            after,
            uncertainty,
            gain};
}

}  // namespace stepdiag
