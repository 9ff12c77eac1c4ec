#include "stepdiag/machine/chain.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
    throw InvalidArgument("chain \"" + std::string(text) + "\": " + why +
                          "; expected the links w, X, Y, Z, b, t in a form like \"[w X' b Y Z t]\"");
}

// Splits "[w X' b Y Z t]" or "wX'bYZt" into links.
std::vector<std::string> links(std::string_view text) {
    std::vector<std::string> names;
    if (!text.empty() && text.find_first_of("[] \t") == std::string_view::npos) {
        for (const char c : text) {
            if (c == '\'' && !names.empty()) names.back() += c;
            else names.emplace_back(1, c);
        }
        return names;
    }
    const auto first = text.find_first_not_of(" \t");
    const auto last = text.find_last_not_of(" \t");
    if (first == std::string_view::npos || text[first] != '[' || text[last] != ']' || first == last)
        refuse(text, "brackets [ ] are missing");
    // Not by a stream, which asks the locale what a space is: on Windows that table goes when a program changes the
    // locale.
    constexpr std::string_view spaces = " \t\n\v\f\r";
    const std::string_view inside = text.substr(first + 1, last - first - 1);
    for (auto begin = inside.find_first_not_of(spaces); begin != std::string_view::npos;) {
        const auto end = std::min(inside.find_first_of(spaces, begin), inside.size());
        names.emplace_back(inside.substr(begin, end - begin));
        begin = inside.find_first_not_of(spaces, end);
    }
    return names;
}

}  // namespace

Chain Chain::parse(std::string_view text) {
    const std::vector<std::string> names = links(text);
    if (names.size() != 6) refuse(text, "has " + std::to_string(names.size()) + " links, not 6");
    if (names.front() != "w") refuse(text, "does not begin with w");
    if (names.back() != "t") refuse(text, "does not end with t");

    const auto bed = std::find(names.begin(), names.end(), "b");
    if (bed == names.end()) refuse(text, "has no b");
    std::vector<Axis> order;
    for (auto link = names.begin() + 1; link != names.end() - 1; ++link) {
        if (link == bed) continue;
        const bool primed = link->size() == 2 && (*link)[1] == '\'';
        const auto axis = std::string_view("XYZ").find((*link)[0]);
        if (axis == std::string_view::npos || (link->size() != 1 && !primed)) refuse(text, "unknown link " + *link);
        if (primed && link > bed) refuse(text, *link + " comes after b, so it takes no prime");
        if (!primed && link < bed) refuse(text, *link + " comes before b, so it needs a prime");
        if (std::find(order.begin(), order.end(), Axis(axis)) != order.end()) refuse(text, *link + " is given twice");
        order.push_back(Axis(axis));
    }
    return Chain({order[0], order[1], order[2]}, int(bed - names.begin()) - 1);
}

std::string Chain::name() const {
    std::string text = "[w";
    for (int i = 0; i <= 3; ++i) {
        if (i == axes_before_bed_) text += " b";
        if (i == 3) break;
        text += std::string(" ") + letter(order_[i]);
        if (i < axes_before_bed_) text += '\'';
    }
    return text + " t]";
}

int Chain::rank(Axis axis) const { return int(std::find(order_.begin(), order_.end(), axis) - order_.begin()); }

}  // namespace stepdiag
