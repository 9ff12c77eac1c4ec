// Uncertain input quantities of a virtual calibration (JCGM 101). There are two kinds:
//  - an input is drawn once for each virtual calibration, as a deviation that is added to the nominal value;
//  - reading noise is drawn for every reading (or pose).
// Signs and frames are those of the nominal quantities: Misalignment, PoseError, Environment (CONVENTIONS).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "stepdiag/measurement/setup_quantity.hpp"
#include "stepdiag/monte_carlo/distribution.hpp"

namespace stepdiag {

// Beside the set-up of each line (measurement/setup_quantity.hpp; `line`): what lines share.
enum class SharedQuantity {
    // of the head (`part`: a component of its design, by name; of all lines that have it)
    part_shift,     // mm, component x, y, z
    part_rotation,  // rad, component about x, y, z
    psd_distance,   // mm, layout psd without design: true minus nominal distance
    beam_offset,    // mm, layout multi_beam without design: component 2 i is u of beam i, 2 i + 1 is v
    reading_model,  // 1: this times L phi^2 is added to distances (0: chief ray; -1.5: single-mode interferometer)
    // Air: true minus assumed state.
    temperature,       // degrees Celsius
    pressure,          // Pa
    humidity,          // 1
    refractive_index,  // 1, relative: factor 1 + this on n
    wavelength,        // 1, relative: true wavelength; the counter uses the nominal one
    // Machine.
    machine_drift,  // mm/s, component x, y, z, of the functional point since the first reading of the run
    // Scales (machine/expansion.hpp), component x, y, z; or the same deviation of all axes.
    expansion,                 // 1/K: true minus stated coefficient
    common_expansion,          // 1/K
    scale_temperature,         // K: true temperature minus that of the run's channels
    common_scale_temperature,  // K
    scale_ramp,                // K/s: how that grows since the run's first reading
    common_scale_ramp          // K/s
};

using InputQuantity = std::variant<SetupQuantity, SharedQuantity>;
std::string name(InputQuantity quantity);  // "reflector", ..., "common_scale_ramp"
InputQuantity parse_input_quantity(const std::string& name);

struct UncertainInput {
    InputQuantity quantity;
    Distribution distribution;
    std::string line = {};  // for quantities of a set-up
    std::string part = {};  // for quantities of a head
    int component = 0;
};
// Name in reports: "reflector a of ppp", "beam constant d1 of ppp", "shift x of splitter", "temperature", ...
std::string name(const UncertainInput& input);

enum class NoiseQuantity {
    channel,       // mm or rad: independent noise of each reading of the channel `channel`
    common,        // mm: one draw for each row, added to all its distances
    head_walk,     // mm/sqrt(s): random walk of the distances since a line's first reading
    machine_walk,  // mm/sqrt(s): random walk of the functional point since the run's first reading; component x, y, z
    position,      // mm: repeatability of the functional point at every pose; component x, y, z
    orientation,   // rad: repeatability of the tool's orientation; component about x, y, z
};

std::string name(NoiseQuantity quantity);  // "channel", ..., "orientation"
NoiseQuantity parse_noise_quantity(const std::string& name);

struct ReadingNoise {
    NoiseQuantity quantity;
    Distribution distribution;  // must be normal for walks
    std::string channel = {};   // "distance", "alpha", "d1", ...
    int component = 0;
};
// Name in reports: "noise of distance", "common noise", "head walk", "machine walk x", "position x", "orientation x".
std::string name(const ReadingNoise& noise);

// The quantities that can be uncertain: the set-up quantities, then the shared ones and the noises.
struct UncertainQuantity {
    enum class Of { line, part, head, air, machine, scale, noise };
    std::string_view name;
    std::string_view key;   // in scenarios, with its unit; empty: it has others
    std::string_view text;  // what reports call it
    Of of;
    std::string_view components = {};       // a letter each; empty: a single one without a letter
    std::optional<HeadLayout> layout = {};  // the only one that has it
    bool of_beams = false;                  // all of them for each of d1 ... dn

    int count(int beams) const;  // of components, with so many beams
};
const std::vector<UncertainQuantity>& uncertain_quantities();
const UncertainQuantity& record(InputQuantity quantity);
const UncertainQuantity& record(NoiseQuantity quantity);

struct UncertainInputs {
    std::vector<UncertainInput> inputs = {};
    std::vector<ReadingNoise> noise = {};
    std::vector<CorrelatedInputs> correlations = {};
};

// Throws InvalidArgument for:
//   - an input given twice, or with a component, line or part that its quantity does not have
//   - an invalid distribution (check(Distribution))
//   - members of a correlation that are out of range, not normal, or in two correlations
//   - a matrix that is not a correlation matrix (size, symmetry, 1 on the diagonal, positive semidefinite)
void check(const UncertainInputs& inputs);

}  // namespace stepdiag
