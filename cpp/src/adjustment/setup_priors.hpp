// How the set-up unknowns of a line are taken, defaults included. Internal: not installed.
#pragma once

#include <string>
#include <vector>

#include "adjustment/channel_model.hpp"
#include "stepdiag/adjustment/adjustment.hpp"

namespace stepdiag {

// The quantity and component that a column of a set-up's vector stands for; none for the cosine error of scale lines,
// which follows from the laser's angles.
struct SetupColumnName {
    SetupQuantity quantity;
    int component;
};
std::optional<SetupColumnName> setup_column_name(int column);

// What "free" means: infinite but for the quantities that act by tilts only, which are 0 on a perfect machine.
PriorUncertainty broadest_prior(SetupQuantity quantity);

// Standard uncertainty of each column (setup::Column, beams) of a line's set-up. A measured line of a single axis, or
// without tilts, has a cosine error, too, as far as neither its laser nor, with tilts, its reflector is known: there
// the laser acts at second order only. Throws InvalidArgument for a negative one, and for a free laser on a scale line.
std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, bool is_single_axis, bool has_tilts, ChannelKind kind,
                                           int columns);

}  // namespace stepdiag
