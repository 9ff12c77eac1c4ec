// Distances of an instrument that counted with the constant index of the air that it assumed, while the run recorded
// the true air. With D_i the distance read at point i of a pass, n_i the index there, and L_0 the line's nominal first
// distance, the standoff,
//   L_i = (n_used (D_i - D_0) + n_0 L_0)/n_i
// takes the place of D_i: such an instrument counts changes of n L from its first reading on. Where that is lost, the
// first one that is there takes its place, with its own nominal distance.
#pragma once

#include <map>
#include <string>

#include "stepdiag/core/air.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

struct CountingHead {
    double standoff;    // mm
    double wavelength;  // in vacuum, nm
};

// The run with distances in its recorded air. A quantity of the air that a pass does not record is as assumed; its
// equation and carbon dioxide are. Where the instrument assumed an index (1: it counted vacuum wavelengths), all
// quantities must be recorded, and carbon dioxide is that of Air. Throws InvalidArgument for a run without any channel
// of the air, a quantity that nothing states, air out of the equation's range, and a row that is not in the plan.
Measurement in_recorded_air(const Measurement& measurement, const Plan& plan,
                            const std::map<std::string, CountingHead>& head_of_line, const Environment& assumed);

}  // namespace stepdiag
