// What a line's set-up is made of: how head and mirror stand, and what is wrong with their readings. The one table of
// these quantities. What is unknown of an adjustment, misaligned in a simulation and uncertain in a virtual calibration
// is a row of it; keys of scenarios, columns of files and reports derive from it.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "stepdiag/measurement/head_layout.hpp"

namespace stepdiag {

// How an unknown is taken: infinite: free; 0: fixed at 0; else the standard uncertainty with which it is known to be 0.
using PriorUncertainty = double;
inline constexpr PriorUncertainty free_unknown = std::numeric_limits<double>::infinity();
inline constexpr PriorUncertainty fixed_unknown = 0.0;
inline constexpr PriorUncertainty usual_drift = 5e-3 / 3600.0;  // mm/s: 5 um/h

enum class SetupQuantity {
    reflector,          // (a, b): mirror normal R_tool F Exp(a, b, 0) z
    laser,              // (a, b): sensor axes F Exp(a, b, 0)
    distance_constant,  // constant error of all distances
    beam_constants,     // layout multi_beam: constant errors of d1 ... dn; of an adjustment: of d2 ... relative to d1
    psd_zero,           // layout psd: reading of a centred spot
    lateral,            // the beam's origin beside its nominal place, along local x and y
    roll,               // of the head about its beam: sensor axes F Exp(a, b, 0) Exp(0, 0, roll)
    gain,               // relative error of tilts; layout psd: of spots; multi_beam: of the beams' offsets
    drift,              // of distances, linear in time since the set-up's first reading
    // No unknowns of an adjustment:
    scale_length,  // error of the distances of the line's last point: that of a length standard;
                   // the inner points of a scale line by their travel
    scale_factor,  // error of distances, relative to their travel from the line's first point
};
inline constexpr int setup_quantity_count = 11;
inline constexpr int adjusted_quantity_count = 9;  // the first ones

struct SetupQuantityRecord {
    std::string_view name;         // in options and files
    std::string_view key;          // in scenarios, with their unit
    std::string_view text;         // in the name of an uncertain input
    std::string_view symbol;       // over a column of a report
    std::string_view unit;         // of the library
    std::string_view report_unit;  // as in keys
    std::string_view meaning;
    // Its prior in an adjustment by default, on measured lines and on scale lines. A drift is fixed where readings
    // of the line have no time, and the laser is on a scale line whose mirror no reading tells.
    PriorUncertainty prior, scale_line_prior;
    std::string_view components = {};       // a letter each; empty: a single one without a letter
    std::optional<HeadLayout> layout = {};  // the only one that has it
    bool of_beams = false;                  // one for each of d1 ... dn
    // What "free" means: infinite but for what acts by tilts only, which are 0 on a perfect machine.
    PriorUncertainty broadest = free_unknown;
    double usual = free_unknown;  // how far from 0 it usually is, where readings do not tell; infinite: they always do
    // The mirror of a scale line where no reading tells it, against the beam: aligned by the beam that comes back.
    PriorUncertainty scale_line_usual = free_unknown;
};

// clang-format off
inline constexpr std::array<SetupQuantityRecord, setup_quantity_count> setup_quantities = {{
    {"reflector", "reflector_urad", "reflector", "reflector", "rad", "urad",
     "tilt (a, b) of the mirror about local x and y", free_unknown, free_unknown, "ab", {}, false, free_unknown, 2e-3,
     500e-6},
    {"laser", "laser_urad", "laser", "laser", "rad", "urad",
     "tilt (a, b) of the beam and the sensor's axes", free_unknown, 500e-6, "ab", {}, false, free_unknown, 2e-3},
    {"distance_constant", "distance_constant_mm", "distance constant", "constant", "mm", "um",
     "constant error of all distances of a line", free_unknown, free_unknown},
    {"beam_constants", "beam_constants_um", "beam constant", "beam", "mm", "um",
     "constant errors of d2, d3, ... relative to d1", free_unknown, free_unknown, "", HeadLayout::multi_beam, true},
    {"psd_zero", "psd_zero_mm", "PSD zero", "psd zero", "mm", "um",
     "reading of a centred spot", free_unknown, free_unknown, "xy", HeadLayout::psd, false, free_unknown, 10.0},
    {"lateral", "lateral_mm", "lateral", "lateral", "mm", "mm",
     "the beam's origin beside its nominal place, along local x and y", 1.0, 1.0, "xy", {}, false, 1e3},
    {"roll", "roll_urad", "roll", "roll", "rad", "urad",
     "roll of the head about its beam", 20e-3, 20e-3, "", {}, false, 1.0},
    {"gain", "gain", "gain", "gain", "1", "ppm",
     "relative error of tilts (of spots; of the beams' offsets)", 0.01, 0.01, "", {}, false, 1.0},
    {"drift", "drift_um_per_h", "drift", "drift", "mm s-1", "um_per_h",
     "error that distances gain in every hour since the set-up's first reading", usual_drift, usual_drift},
    {"scale_length", "scale_um", "scale length", "scale length", "mm", "um",
     "error of the distances of the line's last point", fixed_unknown, fixed_unknown},
    {"scale_factor", "scale_ppm", "scale factor", "scale factor", "1", "ppm",
     "error of distances, relative to their travel", fixed_unknown, fixed_unknown},
}};
// clang-format on

constexpr const SetupQuantityRecord& record(SetupQuantity quantity) {
    return setup_quantities[static_cast<std::size_t>(quantity)];
}
constexpr bool is_adjusted(SetupQuantity quantity) { return static_cast<int>(quantity) < adjusted_quantity_count; }
inline std::string name(SetupQuantity quantity) { return std::string(record(quantity).name); }

// The numbers of a line's set-up, in vectors: component by component in the order of the table, those of beams last.
namespace setup {

struct Columns {
    int first, count;
};
// Of a head with so many beams d1 ... dn.
constexpr Columns columns(SetupQuantity quantity, int beams) {
    const auto count = [](const SetupQuantityRecord& record) {
        return record.components.empty() ? 1 : static_cast<int>(record.components.size());
    };
    int first = 0;
    for (int q = 0; q < setup_quantity_count; ++q) {
        const SetupQuantityRecord& other = setup_quantities[static_cast<std::size_t>(q)];
        const bool before = q < static_cast<int>(quantity) || record(quantity).of_beams;
        if (before && !other.of_beams) first += count(other);
    }
    return {first, record(quantity).of_beams ? beams : count(record(quantity))};
}
constexpr int first_column(SetupQuantity quantity) { return columns(quantity, 0).first; }

enum Column : int {
    reflector = first_column(SetupQuantity::reflector),
    laser = first_column(SetupQuantity::laser),
    distance_constant = first_column(SetupQuantity::distance_constant),
    psd_zero = first_column(SetupQuantity::psd_zero),
    lateral = first_column(SetupQuantity::lateral),
    roll = first_column(SetupQuantity::roll),
    gain = first_column(SetupQuantity::gain),
    drift = first_column(SetupQuantity::drift),
    scale_length = first_column(SetupQuantity::scale_length),
    scale_factor = first_column(SetupQuantity::scale_factor),
    beam_constants = first_column(SetupQuantity::beam_constants),
};
constexpr int size(int beams) { return beam_constants + beams; }

struct Component {
    SetupQuantity quantity;
    int number;  // of beams: 0 for d1
};
constexpr Component component(int column) {
    for (int q = 0; q < setup_quantity_count; ++q) {
        const Columns of = columns(SetupQuantity(q), column + 1);
        if (column >= of.first && column < of.first + of.count) return {SetupQuantity(q), column - of.first};
    }
    return {SetupQuantity::beam_constants, 0};  // no such column
}

}  // namespace setup
}  // namespace stepdiag
