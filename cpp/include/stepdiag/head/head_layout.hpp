// Layout of a head: the quantities that it reads (layouts a and b of the paper).
//   ideal       distance and the mirror's two tilts
//   psd         layout b: distance, and position of a spot on a position sensing device
//   multi_beam  layout a: distances of three or more parallel interferometer beams
#pragma once

#include <string>
#include <string_view>

namespace stepdiag {

enum class HeadLayout { ideal, psd, multi_beam };

std::string name(HeadLayout layout);
HeadLayout parse_head_layout(std::string_view text);  // throws InvalidArgument

}  // namespace stepdiag
