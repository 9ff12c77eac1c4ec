// The exact adjustment: all readings of a run, of any lines, explained at once by the machine's errors at the visited
// nodes and by how head and mirror were set up on each line. Least squares,
//   sum over readings ((read - model(x))/u)^2 + sum over priors (x_j/u_j)^2 -> minimum,
// with the exact pose (machine/machine.hpp) and the exact definition of every reading (measurement/reading.hpp), solved
// by Gauss-Newton to the floor of double precision. Frame choice and signs as in machine/error_map.hpp. Every published
// variant of the method is this with fewer readings or unknowns. Here: what is stated, known and unknown; results.hpp
// has what comes out, and diagnosis/adjust.hpp the function.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>

#include "stepdiag/evaluation/evaluation.hpp"
#include "stepdiag/measurement/setup_quantity.hpp"

namespace stepdiag {

// By SetupQuantity (measurement/setup_quantity.hpp); none: the table's default, but a laser on a measured line is known
// to 2000 urad where the constants of the layout's beams are not fixed, and a drift is fixed where a reading of its
// line has no time. A lateral offset, roll or gain acts by the tilts only, which are 0 on a perfect machine: free means
// known to 1 m, 1 rad, 1, and one whose uncertainty stays above half of that is not determined. What is said of all
// lines reaches scale lines but for the angles of reflector and laser, which are said by their own names.
//
// With D = reflector - laser, the angle that a tilt reads, and m, the reflector's angle to the line, distances read
// travel (3/2 D^2 - m^2/2) too much, in each direction across the line. Where no point stands beside the line in that
// direction (single axes, faces, scale lines), m is known by the priors and by D only, and acts at second order. The
// adjustment linearises at its best value. What is left beyond is the uncertainty of an error by travel, as if it went
// both ways, so large that 95 % intervals contain it. With D known it is one of reading short, travel u^2(m)/2 on
// average. The same holds for D where distances alone or beams with unknown constants are read. On a scale line that
// no reading tells D of, the reflector's prior is that of D, 500 urad by default: it is aligned by the beam that comes
// back.
using SetupPriors = std::array<std::optional<PriorUncertainty>, adjusted_quantity_count>;

// Standard deviation with which the second difference of neighbouring nodes is known to be 0: real axes are smooth.
struct Smoothness {
    double translation = 0.0;  // mm; 0: no such knowledge
    double rotation = 0.0;     // rad
    // Finds a deviation for each of the 18 functions by generalised cross-validation, and takes these two as limits
    // where they are not 0: no function is made smoother than that.
    bool cross_validated = false;
};

// What becomes of slips (FaultKind::slip) that are found. They are unknowns of the adjustment in any case, so that they
// do not spoil its values; report: and the fit is rejected; estimate: that counts as a correction.
enum class Slips { report, estimate };
std::string name(Slips slips);  // "report", "estimate"

// A drift that is no expansion of scales: of spindle, structure, or the mounts of heads. The functional point moves
// along each axis, as if the axis stood further on, in proportion to what has passed since the run's first reading of
// `record`: time, or a temperature (the channels temperature, temperature_x, ..., air_temperature).
struct MachineDrift {
    // By axis: of the prior with mean 0, mm/s, or mm/K with a temperature; 0: none.
    Eigen::Vector3d standard_uncertainty = Eigen::Vector3d::Zero();
    std::string record = "time";
};

struct AdjustmentOptions {
    ReadingUncertainty uncertainty;
    SetupPriors setup = {};
    std::map<std::string, SetupPriors> setup_by_line = {};  // replaces the quantities that it names
    // A set-up serves a run's line and the backward runs that follow it; or, if true, all runs of the line. The time
    // grows with the number of set-ups: 200 runs of seven lines and 10 steps an axis take seconds.
    bool one_setup_per_line = false;
    bool reversal = true;   // where there are backward runs: tables of their own for nodes approached in - direction
    bool rotations = true;  // false: the machine is taken to have no angular errors
    std::optional<Smoothness> smoothness = {};
    // Probability of a false alarm among a thousand tests for faults, which is what a run of 20 steps has: the usual
    // one makes it a gain of 28 in chi-square. 0: faults are looked for at that limit, named and not corrected.
    double outlier_probability = 1.2e-4;
    Slips slips = Slips::report;
    // Where the variance factor is above 1, all stated uncertainties (functions, reversal, squarenesses, set-ups, known
    // combinations, covariance) are multiplied by its root. The fit is then doubtful at best: such readings no longer
    // test what was stated of their noise. Sound only for noise that is larger by one factor throughout.
    bool scale_uncertainty = false;
    bool full_covariance = false;
    PlausibleLimits plausible = {};
    // Coefficients of which the standard uncertainty is not 0 are unknowns, with it as their prior. Deviations of the
    // sensors are no unknowns, because no reading tells them from a scale error: they enter the uncertainties.
    std::optional<KnownExpansion> expansion = {};
    std::optional<MachineDrift> machine_drift = {};  // its rates are unknowns
    bool reliability = false;  // also say which faults the readings control: Adjustment::reliability
    // false: where it is known already what is wrong with the run as a whole. No faults of readings are looked for, and
    // where the minimum is not reached soon, values are those that were, and rejected.
    bool search_faults = true;
    // Relative standard uncertainties of all distances in common: by the scale of the instrument, and by the index of
    // the air, as its sensors make it. As deviations of the scales' sensors they are uncertainty only.
    double distance_scale_uncertainty = 0.0;
    double air_index_uncertainty = 0.0;
    // Estimates how much each channel scatters, and takes that for its noise where it is more than is stated:
    // Adjustment::variance_components. Not where no faults are looked for.
    bool variance_components = true;
};

}  // namespace stepdiag
