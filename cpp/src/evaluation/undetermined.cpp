#include "stepdiag/evaluation/undetermined.hpp"

#include <array>

namespace stepdiag {

std::string name(OpenPart part) {
    constexpr const char* names[] = {"whole", "slope", "positions", "reversal", "reversal_at_home", "setup"};
    return names[static_cast<int>(part)];
}

std::string name(OpenReason reason) {
    constexpr std::array<const char*, open_reason_count> names = {"not_seen",       "not_moved",    "not_separated",
                                                                  "tool_rotations", "few_tilts",    "few_lengths",
                                                                  "few_diagonals",  "laser_angles", "distances_alone"};
    return names[static_cast<std::size_t>(reason)];
}

std::string name(Remedy remedy) {
    constexpr std::array<const char*, remedy_count> names = {"axis_line",
                                                             "scale_line",
                                                             "scale_line_ends",
                                                             "body_diagonals",
                                                             "face_diagonals",
                                                             "lines_to_the_end",
                                                             "lines_there",
                                                             "lost_points",
                                                             "tilts",
                                                             "tilts_of_other_directions",
                                                             "other_directions",
                                                             "other_order",
                                                             "two_directions",
                                                             "three_directions",
                                                             "three_diagonals",
                                                             "both_ways",
                                                             "single_axes_both_ways",
                                                             "prior",
                                                             "line_priors",
                                                             "fixed",
                                                             "scales"};
    return names[static_cast<std::size_t>(remedy)];
}

std::string line_along(Axis axis) {
    std::string line = "000";
    line[index(axis)] = 'p';
    return line;
}

std::string text(const Undetermined& finding) {
    std::string text = finding.part == OpenPart::whole ? "" : name(finding.part) + " of ";
    for (const std::string& parameter : finding.parameters)
        text += parameter + (&parameter == &finding.parameters.back() ? ": " : ", ");
    text += name(finding.reason);
    for (const Remedy remedy : finding.remedies) text += "; " + name(remedy);
    return text + (finding.line.empty() ? "" : " " + finding.line);
}

NothingDetermined::NothingDetermined(const std::string& evaluation, std::vector<Undetermined> findings)
    : InvalidArgument(evaluation + ": nothing can be determined" +
                      (findings.empty() ? "" : ". " + text(findings.front()))),
      evaluation_(evaluation),
      findings_(std::move(findings)) {}

}  // namespace stepdiag
