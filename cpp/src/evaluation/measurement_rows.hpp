// Finds the rows of a measurement in a plan, for the evaluations. Internal: not installed.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

// Of scale lines whose points are not those of the plan.
inline constexpr const char* read_at_its_ends =
    "this scale line was read at its two ends, the plan has every step (expected scale_points = \"ends\")";
inline constexpr const char* read_at_every_step =
    "this scale line was read after every step, the plan has its two ends (expected scale_points = \"steps\")";

// "data row 7 (run 0, line ppp, point 6)"
std::string row_name(const Measurement& measurement, std::size_t row);

// One raw value with its standard uncertainty; empty if the reading was lost.
struct RawValue {
    double value;
    double standard_uncertainty;
};
std::optional<RawValue> raw_value(const Channel* channel, std::size_t row, double usual_uncertainty);

// Rows of each pass (a line in a run), by run and line.
std::map<std::pair<int, std::string>, std::vector<std::size_t>> rows_by_pass(const Measurement& measurement);

// These functions throw InvalidArgument if uncertainties are not positive, or channels do not fit the heads; and,
// naming the row, if a line or point is not in the plan, or a commanded position differs from the plan by more than 1
// um.
void check_uncertainty(const ReadingUncertainty& uncertainty);
void check_heads_fit(const Measurement& measurement, const HeadCalibrations& heads, bool spots_count);
std::vector<PlanPoint> planned_points(const Measurement& measurement, std::size_t row, const Plan& plan);
// One that is where the plan would have it with other points of scale lines is named as that.
void check_station(const Measurement& measurement, std::size_t row, const std::vector<PlanPoint>& planned,
                   const Plan& plan);

}  // namespace stepdiag
