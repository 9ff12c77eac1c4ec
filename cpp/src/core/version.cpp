#include "stepdiag/version.hpp"

#include <algorithm>
#include <utility>

namespace stepdiag {

const char* version() { return STEPDIAG_VERSION; }

std::string newer_format(std::string_view expected, std::string_view given) {
    const auto split = [](std::string_view text) {
        const auto name = text.find_last_not_of("0123456789") + 1;  // npos + 1 is 0
        const auto digits = std::min(text.find_first_not_of('0', name), text.size());
        return std::pair(text.substr(0, name), text.substr(digits));
    };
    const auto [name, number] = split(expected);
    const auto [given_name, given_number] = split(given);
    const bool newer =
        name == given_name && std::pair(given_number.size(), given_number) > std::pair(number.size(), number);
    return newer ? ": it is for a newer stepdiag than " + std::string(version()) + "; install that one" : "";
}

}  // namespace stepdiag
