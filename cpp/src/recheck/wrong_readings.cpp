#include "recheck/wrong_readings.hpp"

#include <algorithm>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

std::vector<FaultClass> faults_of_run(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options) {
    try {
        return adjust(measurement, plan, chain, tool, heads, options).faults;
    } catch (const InvalidArgument&) {
        return {};  // a short run may tell too little of a machine
    }
}

void leave_out(const std::vector<FaultClass>& faults, AdjustmentProblem& problem) {
    std::vector<int> setup_of_row;
    for (const AdjustedPoint& point : problem.points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const std::size_t row = problem.readings()[r].row;
            setup_of_row.resize(std::max(setup_of_row.size(), row + 1), no_unknown);
            setup_of_row[row] = point.setup;
        }
    for (std::size_t k = 0; k < faults.size(); ++k)
        for (const Fault& fault : faults[k].members)
            for (AdjustedReading& reading : problem.readings()) {
                const bool is_hit = fault.kind == FaultKind::reading
                                        ? reading.row == fault.row
                                        : setup_of_row[reading.row] == setup_of_row[fault.row];
                if (is_hit && problem.channel_name(reading) == fault.channel) reading.outlier = int(k) + 1;
            }
}

}  // namespace stepdiag
