#include "stepdiag/measurement/head_layout.hpp"

#include "stepdiag/core/error.hpp"

namespace stepdiag {

std::string name(HeadLayout layout) {
    return layout == HeadLayout::ideal ? "ideal" : layout == HeadLayout::psd ? "psd" : "multi_beam";
}

HeadLayout parse_head_layout(std::string_view text) {
    for (const HeadLayout layout : {HeadLayout::ideal, HeadLayout::psd, HeadLayout::multi_beam})
        if (text == name(layout)) return layout;
    throw InvalidArgument("layout: expected \"ideal\", \"psd\" or \"multi_beam\", got \"" + std::string(text) + "\"");
}

}  // namespace stepdiag
