// What an adjustment found: calibration, set-up, residuals, faults of the readings and the verdict of the fit. Findings
// say what the readings do not determine.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/evaluation/evaluation.hpp"
#include "stepdiag/measurement/setup_quantity.hpp"

namespace stepdiag {

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

// What the stated standard uncertainties of a channel's readings are multiplied by.
struct NoiseFactor {
    std::string channel;    // "distance": of all beams, too
    std::string line = {};  // empty: on all lines that have no factor of their own
    double factor = 1.0;
};

// How much the readings of a channel scatter, as their residuals tell it (diagnosis/variance_components.hpp).
struct VarianceComponent {
    NoiseFactor noise;            // root of the component: times what is stated
    double standard_uncertainty;  // of the factor
    bool used = false;            // stated uncertainties were multiplied by it; otherwise they stayed
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
    double size;                  // error of the reading, mm or rad; by a factor where the line is farthest
    double standard_uncertainty;  // of the size
    double chi_square_gain;       // how much chi-square falls without it
};

// What was done about a fault. left_out: all readings that may be the wrong one, so that what only they determined is
// not. estimated: the sizes of all alternatives are unknowns; a single one is free, of several each is known to be 0 to
// what it would be alone, so that the spread of the alternatives is in the uncertainties.
enum class FaultTreatment { none, left_out, estimated };
std::string name(FaultTreatment treatment);  // "none", ...

// Faults of which the readings do not tell which one happened: the gains of all others are behind by 25 and more. Those
// of single readings come with the readings that only they control, even where second order distinguishes them. A wrong
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

    bool is_distinguished() const { return members.size() == 1; }
};

// Why a fit is not accepted, or what its residuals have in common.
enum class FitFinding {
    no_redundancy,  // nothing controls the readings
    no_noise,       // rms of the residuals in units of their rounding: a simulation without noise
    noise_factor,   // root of the variance factor, beyond what is credible; of a channel: of its variance component
    misfit,         // the same, where the readings scatter more than stated
    no_misfit,      // root of the variance factor: the readings scatter by it less than stated
    uneven_misfit,  // root of the variance factor of one group of readings, where it differs from that of the others
    trend,          // residuals of one channel run with time or position: from the first reading to the last
    prior,          // distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2)
    prior_scatter,  // standard deviation of all values of a set-up quantity, as far as the readings tell it
    fault,          // gain in chi-square of a fault that was found and not corrected
    alternatives,   // what alternative faults make of one parameter differs by this much, mm or rad
    fault_cost,     // what was done about faults makes the largest uncertainty of a family so many times as large
    undetermined,   // it leaves parameters undetermined that were not
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
    std::string line = {};     // of noise, a trend or a prior; empty: all
    std::string channel = {};  // of noise or a trend: "distance", ..., empty: all; of priors: the quantity
    int component = 0;         // of a prior; of "expansion" the axis, -1: of all in common; of "machine_drift" the axis
    double standard_uncertainty = 0.0;  // of the value of noise, a trend, scaled
    int run = -1;                       // of an uneven misfit: this run alone; -1: all
    FitAspect aspect = FitAspect::whole;
    bool alternative = false;  // of a trend: instead of the one before; the readings do not tell which
    int fault = 0;             // of a fault and of alternatives: number of the class, from 1
    // Of alternatives, fault_cost, undetermined: "EXX", ...; of a mistake, an implausible_input what it is.
    std::string parameter = {};
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
// with a probability of 99 % where it is 7.6 times as large as the standard uncertainty of its size; it is
// distinguished from another one where chi-square with that one would be larger by 25. Two faults are twins, which no
// size distinguishes, where their effects on the readings have a correlation of 0.999 and more and those on the
// calibration differ. Of long runs the faults of evenly spaced places stand for all.
struct FaultControl {
    FaultKind kind;
    std::string channel;              // "distance" (of all beams), "tilt" or "spot"
    int count = 0;                    // of controlled faults, one a place
    int uncontrolled = 0;             // more of them, which no other reading controls
    int twins = 0;                    // those of `count` that have a twin
    double found_from = 0.0;          // all of `count` are found from this size on; mm or rad
    double distinguished_from = 0.0;  // those without a twin are, from this size on

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
    std::vector<VarianceComponent> variance_components = {};  // of channels that others control

    double variance_factor() const;             // weighted_square_sum/degrees_of_freedom; 1 without freedom
    std::vector<std::size_t> outliers() const;  // readings that were left out: into `residuals`, by their number
};

}  // namespace stepdiag
