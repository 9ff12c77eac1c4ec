// The verdict of the fit that a calibration came from, as its file carries it in the leading line "# fit=...".
#pragma once

#include <map>
#include <optional>
#include <string>

namespace stepdiag {

enum class Fit {
    accepted,   // the readings agree with each other and with what was known
    doubtful,   // they scatter more or less than their stated uncertainties allow
    rejected,   // they contradict each other or what was known: the values are not to be used
    unchecked,  // nothing controls the readings
};

std::string name(Fit fit);

// What a table's leading lines say; none where they do not, as in an error map. Throws InvalidArgument naming the table
// (`name`) for any other word.
std::optional<Fit> fit_of(const std::map<std::string, std::string>& header, const std::string& name);

}  // namespace stepdiag
