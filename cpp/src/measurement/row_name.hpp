// A row of a measurement in messages. Internal: not installed.
#pragma once

#include <string>

#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {

// "row 7 (run 0, line ppp, point 6)"
inline std::string row_name(const Station& station, std::size_t row) {
    return "row " + std::to_string(row + 1) + " (run " + std::to_string(station.run) + ", line " + station.line.name() +
           ", point " + std::to_string(station.point) + ")";
}

}  // namespace stepdiag
