// What an evaluation found out about a machine: the 21 parameters as far as they could be determined, with uncertainty.
// Frame choice and signs as in machine/error_map.hpp. What the readings do not determine is absent and said, never
// invented.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/evaluation/undetermined.hpp"
#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/error_map.hpp"
#include "stepdiag/machine/fit.hpp"

namespace stepdiag {

// One error function at the nodes of its axis.
struct CalibratedFunction {
    std::vector<double> position;              // mm
    std::vector<double> value;                 // mm or rad
    std::vector<double> standard_uncertainty;  // mm or rad; NaN where a file that was read does not give it
    // False: only the shape is known. The values are then those with both ends at 0; any multiple of the position may
    // be added.
    bool slope_determined = true;
};

// Reversal error of one function (ISO 230-2): its value at a node approached in + direction minus that in - direction.
// A calibration's functions are those of the + direction, and its squarenesses belong to both.
struct CalibratedReversal {
    std::vector<double> position;              // mm
    std::vector<double> value;                 // mm or rad
    std::vector<double> standard_uncertainty;  // mm or rad; NaN where a file that was read does not give it
    // Of the function approached in - direction, which is function - reversal.
    std::vector<double> negative_standard_uncertainty;
    // False: only its change from home is known; the values are then 0 at home.
    bool constant_determined = true;
};

struct CalibratedSquareness {
    double value;                 // rad
    double standard_uncertainty;  // rad
};

// What makes standard uncertainties beside the noise of the readings.
enum class UncertaintySource { scale, temperature, air };
std::string name(UncertaintySource source);  // "scale", "temperature", "air"

// What a calibration was made from, and with what: the keys of Calibration::provenance, and of leading lines of its
// file. Fingerprints are SHA-256 in hexadecimal digits, of the bytes of the run, the scenario and the heads'
// descriptions.
inline constexpr std::array provenance_keys = {"program", "run_sha256", "scenario_sha256", "heads_sha256", "options"};

struct Calibration {
    std::string method;
    Chain chain;
    Eigen::Vector3d volume;  // mm
    Eigen::Vector3d tool;    // mm

    std::array<std::optional<CalibratedFunction>, function_count> functions;
    std::array<std::optional<CalibratedSquareness>, squareness_count> squarenesses;
    std::vector<Undetermined> findings = {};  // of an evaluation: what is missing, why, and what would help
    // The same in words, one sentence each, as files hold them; an evaluation leaves the words to its caller.
    std::vector<std::string> undetermined = {};

    // Of all values in the order of the tables (functions by FunctionId::index, nodes ascending, then C0Y, B0Z, A0Z);
    // native units. Empty unless asked for.
    Eigen::MatrixXd covariance = {};

    std::array<std::optional<CalibratedReversal>, function_count> reversal = {};  // where backward runs tell it
    std::string date = {};  // of the evaluation: ISO 8601, UTC; empty where it is not known

    // Whether it, or one that it was made from, was read from a file without a checksum: nothing tells whether its
    // values are those that were written (machine/parameter_table.hpp).
    bool unverified = false;

    // Verdict of the fit; none where it is not known, as in files of earlier versions.
    std::optional<Fit> fit = {};
    std::optional<double> variance_factor = {};  // of that fit; none where nothing controls the readings
    // Why that verdict: stable codes, name(FitFinding) of an adjustment; and in words, one sentence each, as files hold
    // them. An evaluation leaves the words to its caller.
    std::vector<std::string> fit_codes = {};
    std::vector<std::string> fit_reasons = {};
    // How large faults of readings may be in it unseen, and what they then do; likewise in words.
    std::vector<std::string> unseen_faults = {};
    // What all uncertainties were multiplied by beyond what follows from those of the readings; none: by nothing.
    std::optional<double> uncertainty_scaled = {};
    // Standard uncertainty of the functional point by errors between the nodes, which no reading shows, as it was
    // stated, mm; none: nothing was stated. It is in no other uncertainty.
    std::optional<double> between_nodes = {};

    // Positioning errors are referred to this temperature of the scales, degrees Celsius; or they are as found at these
    // (by axis, means over all readings); neither: nothing was recorded.
    std::optional<double> temperature_reference = {};
    std::optional<Eigen::Vector3d> temperature_as_found = {};
    // The scales' expansion by which they are referred: at other temperatures the machine stands where the calibration
    // says only with the same coefficients. By axis, 1/K; in an adjustment as it was found. None: not known.
    std::optional<Eigen::Vector3d> expansion = {};
    Eigen::Vector3d fixed_point = Eigen::Vector3d::Zero();  // from which the scales expand, by axis, mm

    // Under which conditions it was evaluated, as they were used, and the budget of its largest positioning
    // uncertainty: in words, a sentence each, as files hold them; an evaluation leaves the words to its caller.
    std::vector<std::string> conditions = {};
    std::string budget = {};
    // Of an adjustment: how much of the standard uncertainties is made by each source that was stated, in the order of
    // the covariance, mm or rad. What is left is noise of the readings and what the set-up makes of it. In no file.
    std::map<UncertaintySource, std::vector<double>> uncertainty_parts = {};

    std::map<std::string, std::string> provenance = {};  // by provenance_keys, as far as it is known
};

// A value of a calibration's tables (order of Calibration::covariance).
struct CalibrationEntry {
    std::string parameter;  // "EXX", ..., "C0Y"
    double position;        // mm; NaN for a squareness
};

// The entries of a calibration in the order of Calibration::covariance, and their values.
std::vector<CalibrationEntry> calibration_entries(const Calibration& calibration);
Eigen::VectorXd calibration_values(const Calibration& calibration);

// Throws InvalidArgument naming the parameter where a calibration put together by hand is none: a volume that is not
// positive, nodes that do not ascend, values that are not finite, uncertainties below 0, a covariance that is no matrix
// of these values (its size, symmetry, |c_ij| <= u_i u_j, c_ii = u_i^2), sentences of more than one line, a provenance
// of other keys or empty, reasons of a verdict and codes that differ in number.
void check(const Calibration& calibration);

// One line that says to which point the straightnesses of a calibration refer, and what they are at the functional
// point of an axis that carries the workpiece: "... EYX + p ECX, EZX - p EBX" (theta x p along the axis).
std::string straightness_reference(const Chain& chain, const Eigen::Vector3d& tool);

bool is_anything_determined(const Calibration& calibration);
// Where there is a reversal error the function's table is that of the + direction, and function - reversal that of the
// - direction. A reversal error without its function has no place in a table.
ParameterTable to_parameter_table(const Calibration& calibration);

// CSV with format, chain, volume_mm, tool_mm, method, date, unverified, fit, variance_factor, uncertainty_scaled,
// between_nodes_mm, temperature_reference_c with expansion_per_k and fixed_point_mm, or temperature_as_found_c,
// fit_codes, fit_reasons, unseen_faults, conditions, budget, straightness_reference, provenance_keys,
// undetermined_slopes, undetermined_reversal_constants and undetermined in the leading lines; not kept are the
// covariance and the uncertainty of a reversal error, which is not that of its two tables. Reading throws
// InvalidArgument naming file and line, also where chain, volume or tool is missing.
void write_calibration(const Calibration& calibration, const std::string& path);
Calibration read_calibration(const std::string& path);

}  // namespace stepdiag
