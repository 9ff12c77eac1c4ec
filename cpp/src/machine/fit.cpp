#include "stepdiag/machine/fit.hpp"

#include "stepdiag/core/error.hpp"

namespace stepdiag {

std::string name(Fit fit) {
    switch (fit) {
        case Fit::accepted: return "accepted";
        case Fit::doubtful: return "doubtful";
        case Fit::rejected: return "rejected";
        case Fit::unchecked: return "unchecked";
    }
    return "";
}

std::optional<Fit> fit_of(const std::map<std::string, std::string>& header, const std::string& name) {
    const auto entry = header.find("fit");
    if (entry == header.end()) return std::nullopt;
    for (const Fit fit : {Fit::accepted, Fit::doubtful, Fit::rejected, Fit::unchecked})
        if (entry->second == stepdiag::name(fit)) return fit;
    throw InvalidArgument(name + ": fit: expected accepted, doubtful, rejected or unchecked, got \"" + entry->second +
                          "\"");
}

}  // namespace stepdiag
