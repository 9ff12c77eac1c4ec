// Column of a channel in a measurement file. Internal: not installed.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace stepdiag {

struct ChannelColumn {
    std::string unit;              // in the column's name: "mm", "urad", "s", "c"
    int exponent_shift;            // power of ten from this unit to the native unit
    std::string uncertainty_unit;  // "um" or "urad"; empty if the channel has no uncertainty column
    int uncertainty_shift;
};

bool is_beam_channel(std::string_view name);                            // d1, d2, ...
std::optional<ChannelColumn> channel_column(std::string_view channel);  // empty for an unknown channel

}  // namespace stepdiag
