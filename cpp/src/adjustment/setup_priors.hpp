// How the set-up unknowns of a line are taken, defaults included. Internal: not installed.
#pragma once

#include <string>
#include <vector>

#include "adjustment/channel_model.hpp"
#include "stepdiag/adjustment/adjustment.hpp"

namespace stepdiag {

// Standard uncertainty of each column (setup::Column) of a line's set-up. A measured line of a single axis, or without
// tilts, has a cosine error, too, as far as neither its laser nor, with tilts, its reflector is known: there the laser
// acts at second order only. It makes distances read too little by their travel: the column scale_factor. Throws
// InvalidArgument for a negative one, and for a free laser on a scale line.
std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, bool is_single_axis, bool has_tilts,
                                           const ChannelModel& model);

}  // namespace stepdiag
