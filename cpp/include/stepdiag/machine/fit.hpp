// Verdict on the fit of a calibration. A calibration file states it in the leading line "# fit=...".
#pragma once

#include <map>
#include <optional>
#include <string>

namespace stepdiag {

enum class Fit {
    accepted,   // the readings agree with each other and with the priors
    doubtful,   // the readings scatter more or less than their stated uncertainties explain
    rejected,   // the readings contradict each other or the priors; do not use the values
    unchecked,  // no redundant reading controls the others
};

std::string name(Fit fit);

// The verdict in a table's leading lines; empty if they have none, as in an error map. Throws InvalidArgument for an
// unknown word. The message names the table by `name`.
std::optional<Fit> fit_of(const std::map<std::string, std::string>& header, const std::string& name);

}  // namespace stepdiag
