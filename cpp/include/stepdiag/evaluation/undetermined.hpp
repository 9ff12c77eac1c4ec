// What the readings leave open, as data: of which parameters, why, and what would help. Whoever shows it words it; the
// Python package does so in one module.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stepdiag/core/axis.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

enum class OpenPart {
    whole,             // everything of the parameters
    slope,             // the shape is known, with both ends at 0
    positions,         // the values at some positions
    reversal,          // the reversal errors
    reversal_at_home,  // of the reversal errors only the change along the axis is known
    setup,             // unknowns of how head and mirror were set up
};
std::string name(OpenPart part);  // "whole", ...

enum class OpenReason {
    not_seen,         // the readings do not tell it
    not_moved,        // no line with readings moves the axis to its end
    not_separated,    // the readings do not distinguish these parameters
    tool_rotations,   // the axis' own line does not tell it from rotations that move the tool
    few_tilts,        // a step was read on too few lines: with tilts,
    few_lengths,      // with distance, tilts and known angles,
    few_diagonals,    // on body diagonals
    laser_angles,     // readings were lost, and the lines that bridge them have unknown laser angles
    distances_alone,  // the method uses no tilts
};
inline constexpr int open_reason_count = 9;
std::string name(OpenReason reason);  // "not_seen", ...

enum class Remedy {
    axis_line,                  // add the line `line`
    scale_line,                 // add the scale line `line`
    scale_line_ends,            // measure both ends of the scale line
    body_diagonals,             // add body diagonals
    face_diagonals,             // add the two face diagonals of the squareness' plane
    lines_to_the_end,           // add lines that move the axis to its end
    lines_there,                // measure more lines that visit the positions
    lost_points,                // measure the lost points again
    tilts,                      // read tilts
    tilts_of_other_directions,  // read tilts on lines of other directions
    other_directions,           // add lines of other directions
    other_order,                // add lines with another order of steps
    two_directions,             // measure two lines of different direction at every step
    three_directions,           // three of them
    three_diagonals,            // three body diagonals of different direction
    both_ways,                  // measure more lines forward and backward
    single_axes_both_ways,      // measure single-axis lines forward and backward
    prior,                      // give the set-up unknown a prior
    line_priors,                // give priors to the set-up of the axis' line
    fixed,                      // take the set-up unknown as fixed
    scales,                     // make the scales known
};
inline constexpr int remedy_count = 21;
std::string name(Remedy remedy);  // "axis_line", ...

struct Undetermined {
    OpenPart part;
    std::vector<std::string> parameters;  // "EXX", ..., "C0Y"; of a set-up its quantity: "reflector", ...
    OpenReason reason = OpenReason::not_seen;
    std::vector<Remedy> remedies = {};   // one of them helps, the first one best
    std::vector<double> positions = {};  // mm: of `positions`; of few_...: the step's two ends
    // Of few_...: the step of the axis, counted from 1; the lines that it was read on, and those of the plan.
    int step = 0, lines_read = 0, lines_planned = 0;
    std::string line = {};  // to add
    // Of a set-up: the component, as in SetupEstimate; the first run and the line of each set-up.
    int component = 0;
    std::vector<std::pair<int, std::string>> setups = {};
};

// "p00", "0p0", "00p"
std::string line_along(Axis axis);

// The names of its parts, for files of those who word nothing: "slope of EXX: not_seen; axis_line p00".
std::string text(const Undetermined& finding);

// Thrown by evaluations of readings that determine nothing at all.
class NothingDetermined : public InvalidArgument {
public:
    NothingDetermined(const std::string& evaluation, std::vector<Undetermined> findings);
    const std::string& evaluation() const { return evaluation_; }
    const std::vector<Undetermined>& findings() const { return findings_; }

private:
    std::string evaluation_;
    std::vector<Undetermined> findings_;
};

}  // namespace stepdiag
