// How the set-up unknowns of a line are taken, defaults included. Internal: not installed.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "adjustment/channel_model.hpp"
#include "stepdiag/adjustment/options.hpp"

namespace stepdiag {

// What the readings of a line can tell of its set-up.
struct LineReadings {
    bool tilts;                  // the run has tilts, spots or beams on this line
    bool times;                  // of every reading
    std::array<bool, 2> beside;  // whether points stand beside the line, along local x and y
    double tilt = 0.0;           // about that of the mirror against the beam, rad
    // How far laser and mirror of the run's lines usually stand from where they belong, as far as their tilts show it.
    double usual_angle = record(SetupQuantity::laser).usual;
};

// Standard uncertainty of each column (setup::Column) of a line's set-up. With D = mirror - laser, the angle that a
// tilt reads, and m, the mirror's angle to the line, distances read travel (3/2 D^2 - m^2/2) too much, in each of the
// two directions across the line. Tilts tell D; points beside the line tell m. Where they do not, the adjustment
// linearises at what the priors say of them, and the column scale_factor takes what is left, the second order of what
// remains unknown: so large that intervals of 95 % contain it, whatever its sign. A free mirror on a scale line takes
// D, and the laser's angles are fixed there: what they do to first order, D times their uncertainty, is in the
// scale_factor too. (As unknowns, whose squares act on lengths, they would let a wrong length bend the solution.) Where
// nothing tells D of a scale line, its mirror is an unknown with D's prior. Throws InvalidArgument for a negative
// prior, and for a free laser on a scale line.
std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, const LineReadings& readings, const ChannelModel& model);

}  // namespace stepdiag
