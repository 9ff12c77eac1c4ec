// The rows of a measurement as evaluators find them in a plan. Internal: not installed.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

// "data row 7 (run 0, line ppp, point 6)"
std::string row_name(const Measurement& measurement, std::size_t row);

// One raw value with its standard uncertainty; none where it was lost.
struct RawValue {
    double value;
    double standard_uncertainty;
};
std::optional<RawValue> raw_value(const Channel* channel, std::size_t row, double usual_uncertainty);

// The rows of each pass, a run's line, by run and line.
std::map<std::pair<int, std::string>, std::vector<std::size_t>> rows_by_pass(const Measurement& measurement);

// These throw InvalidArgument: for uncertainties that are not positive; for channels that do not fit the heads; naming
// the row, for a line or point that is not the plan's, or a commanded position more than 1 um off the plan's.
void check_uncertainty(const ReadingUncertainty& uncertainty);
void check_heads_fit(const Measurement& measurement, const HeadCalibrations& heads, bool spots_count);
std::vector<PlanPoint> planned_points(const Measurement& measurement, std::size_t row, const Plan& plan);
void check_station(const Measurement& measurement, std::size_t row, const std::vector<PlanPoint>& planned);

}  // namespace stepdiag
