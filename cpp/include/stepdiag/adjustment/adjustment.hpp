// The exact adjustment: all readings of a run, of any lines, explained at once by the machine's errors at the visited
// nodes and by how head and mirror were set up on each line. Least squares,
//   sum over readings ((read - model(x))/u)^2 + sum over priors (x_j/u_j)^2 -> minimum,
// with the exact pose (machine/machine.hpp) and the exact definition of every reading (measurement/reading.hpp), solved
// by Gauss-Newton to the floor of double precision. Frame choice and signs as in machine/error_map.hpp. Every published
// variant of the method is this with fewer readings or unknowns. Findings say what the readings do not determine.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

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
};

// One set-up unknown, as it was found.
struct SetupEstimate {
    int run;  // the first run that has this set-up
    std::string line;
    SetupQuantity quantity;
    int component;                // of angles and offsets: 0, 1; of beams: 1 for d2, ...
    std::optional<double> value;  // none where it is not determined
    double standard_uncertainty;
    PriorUncertainty prior;
};

// An expansion coefficient, as it was found.
struct ExpansionEstimate {
    std::vector<int> axes;        // that have it in common: 0, 1, 2
    double value;                 // 1/K
    double standard_uncertainty;  // 1/K
    double stated;                // 1/K: the prior's value
    PriorUncertainty prior;       // 1/K: its standard uncertainty
};

// A rate of the machine's drift, as it was found: mm/s, or mm/K with a temperature.
struct DriftEstimate {
    int axis;  // 0, 1, 2
    double value;
    double standard_uncertainty;
    PriorUncertainty prior;
};

// One reading: by row of the measurement and channel.
struct ReadingResidual {
    std::size_t row;
    std::string channel;
    double residual;    // read - model, native units
    double redundancy;  // 0: nothing controls this reading; 1: all others know it better
    double normalised;  // residual/(u sqrt(redundancy)); 0 where nothing controls it
    int outlier = 0;    // n: left out with the n-th class of faults; redundancy and normalised: of a control reading

    bool used() const { return outlier == 0; }
};

// Why stated uncertainties of a channel were too small: its numbers are rounded as doubles or to the decimals of a
// file, or tilts or the laser are known so much worse that double precision could not weigh both.
enum class RoundingCause { doubles, decimals, weights };
std::string name(RoundingCause cause);  // "doubles", ...
// What took the place of a channel's stated uncertainties; mm or rad.
struct RoundedChannel {
    std::string channel;
    double stated;  // standard uncertainty
    double used;    // in its place
    double step;    // of the decimals; 0: more of them than count
    RoundingCause cause;
};

// What may be wrong with the readings of one channel in one set-up. A slip is an offset of all of them from a point on,
// in the order in which they were made: a fringe counter that lost count, a head that was knocked. A factor makes
// distances too long by a part of the travel: the air of a single line, tilts whose zero is off (a distance is
// corrected by their squares).
enum class FaultKind { reading, slip, factor };
std::string name(FaultKind kind);  // "reading", ...
// One fault that explains the readings, if it is the one.
struct Fault {
    FaultKind kind;
    std::size_t row;  // of the reading, of the first one that slipped, or of the line's first
    int run;
    std::string line;
    int point;
    std::string channel;
    double size;                  // what was read too much, mm or rad; by a factor where the line is farthest
    double standard_uncertainty;  // of the size
    double chi_square_gain;       // what it takes off chi-square
};

// What was done about a fault. left_out: all readings that may be the wrong one, so that what only they determined is
// not. estimated: the sizes of all alternatives are unknowns; a single one is free, of several each is known to be 0 to
// what it would be alone, so that the spread of the alternatives is in the uncertainties.
enum class FaultTreatment { none, left_out, estimated };
std::string name(FaultTreatment treatment);  // "none", ...

// Faults of which the readings do not tell which one happened: the gains of all others are behind by 25 and more. Those
// of single readings come with the readings that only they control, even where second order tells them apart. A wrong
// first reading is also a slip of all later ones, where the constant of its channel is free: both are named.
struct FaultClass {
    std::vector<Fault> members;  // the best first
    FaultTreatment treatment = FaultTreatment::none;
    bool corrected = false;  // so that the verdict is that of the fit after it
    // Of several that are estimated: the parameter that their solutions differ in most, how much, and the plausible
    // limit of that, all mm or rad.
    std::string widest = {};
    double spread = 0.0;
    double plausible = 0.0;

    bool told_apart() const { return members.size() == 1; }
};

// Why a fit is not accepted, or what its residuals have in common.
enum class FitFinding {
    no_redundancy,  // nothing controls the readings
    no_noise,       // rms of the residuals in units of their rounding: a simulation without noise
    noise_factor,   // root of the variance factor, beyond what is credible
    misfit,         // root of the variance factor: the readings scatter by it more than stated
    no_misfit,      // root of the variance factor: the readings scatter by it less than stated
    uneven_misfit,  // root of the variance factor of one group of readings, where it differs from that of the others
    trend,          // residuals of one channel run with time or position: from the first reading to the last
    prior,          // distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2)
    prior_scatter,  // standard deviation of all values of a set-up quantity, as far as the readings tell it
    fault,          // gain in chi-square of a fault that was found and not corrected
    alternatives,   // what alternative faults make of one parameter differs by this much, mm or rad
    scaled,         // root of the variance factor, by which the uncertainties were multiplied (scale_uncertainty)
    mistake,        // one in the whole run or its scenario would explain the readings; adjust() looks for none
    implausible_input,  // a temperature, coefficient, ... that no workshop has; adjust() looks at none
};
std::string name(FitFinding finding);  // "no_redundancy", ...

// Which readings scatter unevenly, or what a trend runs with.
enum class FitAspect {
    whole,
    second_half,       // of the run, in the order of time (of the rows, where there is no time)
    far_half,          // of the lines
    time,              // as second_half counts it
    position,          // along the line
    time_or_position,  // which are alike in this run
};
std::string name(FitAspect aspect);  // "" of the whole, "second_half", ...

struct FitReason {
    FitFinding finding;
    double value;  // of a trend mm or rad
    double limit;  // of an uneven misfit that of the other readings; of noise, trends, prior_scatter what is expected
    std::string line = {};     // of an uneven misfit, a trend or a prior; empty: all
    std::string channel = {};  // of an uneven misfit or a trend: "distance", ..., empty: all; of priors: the quantity
    int component = 0;         // of a prior; of "expansion" the axis, -1: of all in common; of "machine_drift" the axis
    double standard_uncertainty = 0.0;  // of the value of a misfit, no_misfit, trend, scaled
    int run = -1;                       // of an uneven misfit: this run alone; -1: all
    FitAspect aspect = FitAspect::whole;
    bool alternative = false;    // of a trend: instead of the one before; the readings do not tell which
    int fault = 0;               // of a fault and of alternatives: number of the class, from 1
    std::string parameter = {};  // of alternatives: "EXX", ...; of a mistake, an implausible_input what it is
};

// Whether the readings of an adjustment agree with each other, with their uncertainties and with the priors. It does
// not see what the parameters absorb: a wrong wavelength, tool or place of b in the chain.
struct Verdict {
    Fit fit = Fit::unchecked;
    std::vector<FitReason> reasons = {};
};

// A sum of unknowns that are not determined one by one: slopes of positioning errors and straightnesses, or two
// unknowns of one set-up.
struct KnownCombination {
    struct Term {
        double weight;
        std::string parameter;  // "EXX", ...; of a set-up its quantity: "reflector", ...
    };
    std::vector<Term> terms = {};
    int component = 0;  // of a set-up: as in SetupEstimate; its first run, and its line, which is empty for slopes
    int run = 0;
    std::string line = {};
    double value = 0.0;  // rad; of slopes mm/mm
    double standard_uncertainty = 0.0;
};

// Which faults of one kind the readings control (reliability, W. Baarda 1968), to first order. A test finds a fault
// with a probability of 99 % where it is 7.6 times as large as the standard uncertainty of its size; it is told from
// another one where chi-square with that one would be larger by 25. Two faults are twins, which no size tells apart,
// where their effects on the readings have a correlation of 0.999 and more and those on the calibration differ. Of long
// runs the faults of evenly spaced places stand for all.
struct FaultControl {
    FaultKind kind;
    std::string channel;      // "distance" (of all beams), "tilt" or "spot"
    int count = 0;            // of controlled faults, one a place
    int uncontrolled = 0;     // more of them, which no other reading controls
    int twins = 0;            // those of `count` that have a twin
    double found_from = 0.0;  // all of `count` are found from this size on; mm or rad
    double told_from = 0.0;   // those without a twin are told from all others from this size on

    // Largest of the calibrated values of one kind (mm or rad).
    struct Effect {
        double hidden = 0.0;  // of faults just not found; infinite: of what nothing controls
        double shared = 0.0;  // by the size of a fault, where its twin may have been it; in mm or rad each
    };
    Effect positioning = {}, straightness = {}, angle = {}, squareness = {};
};

// What the faults of one kind may do to a calibration without being seen, one at a time, to first order: the worst of
// them, as found by looking where they have most effect and from there at what affects that value most.
struct UnseenFault {
    FaultKind kind;
    std::string channel;  // as in FaultControl
    // Any fault of this kind is found from this size on with 99 %; mm or rad; of those that are controlled at all.
    double size = 0.0;
    bool controlled = true;  // all that were looked at are; false: some may have any size
    // Largest change of a calibrated value by a fault just not found; infinite: of one that nothing controls.
    double positioning = 0.0, straightness = 0.0, angle = 0.0, squareness = 0.0;
};

struct Adjustment {
    Calibration calibration;  // carries fit and variance factor
    std::vector<SetupEstimate> setup;
    std::vector<ReadingResidual> residuals;
    double weighted_square_sum;  // of residuals and priors
    int degrees_of_freedom;
    double chi_square_probability;  // of a larger square sum, if model and uncertainties are right; 1 without freedom
    int iterations;                 // steps from zero
    std::vector<KnownCombination> combinations;
    std::array<double, function_count> smoothness = {};  // deviations of second differences in force; 0: none
    std::vector<FaultClass> faults = {};
    Verdict verdict = {};
    std::vector<FaultControl> reliability = {};  // if it was asked for
    std::vector<UnseenFault> unseen = {};
    std::vector<ExpansionEstimate> expansion = {};
    std::vector<DriftEstimate> machine_drift = {};
    std::vector<RoundedChannel> rounded = {};

    double variance_factor() const;             // weighted_square_sum/degrees_of_freedom; 1 without freedom
    std::vector<std::size_t> outliers() const;  // readings that were left out: into `residuals`, by their number
};

// Throws InvalidArgument for readings that do not belong to the plan, channels that do not fit the head, a drift that
// is not fixed without what it goes with, options that make no sense, where nothing at all can be determined, or for a
// result that is not plausible.
Adjustment adjust(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                  const HeadCalibrations& heads, const AdjustmentOptions& options = {});

// How well a run fits and nothing else, in a tenth of an adjustment's time: for comparing many changed copies of a run.
struct FitQuality {
    double weighted_square_sum;  // of residuals and priors
    int degrees_of_freedom;
};
// Without search for faults, tests, uncertainties, cross-validation and plausible limits. At most `most_steps` plain
// steps of Gauss-Newton from zero, and the least square sum on the way: a run that fits is near its minimum after three
// of them and at it after eight; of another one it is no less than that of its minimum, and nobody needs more.
// Nothing where there are no readings or no number comes out. Throws InvalidArgument as adjust does.
std::optional<FitQuality> fit_quality(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                      const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                      const AdjustmentOptions& options, int most_steps);

}  // namespace stepdiag
