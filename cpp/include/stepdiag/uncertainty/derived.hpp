// Quantities derived from a calibration: the errors of the tool at any point and along the body diagonals (ISO 230-6).
// Their uncertainty follows from the covariance of the calibration's values. volume_ranges.hpp has ranges over the
// volume. The errors
//   e = sum_a (delta_a + theta_a x L_a),  orientation = sum_a theta_a   (machine/machine.hpp, to first order)
// are linear in the calibration's entries. Functions are linear between nodes and keep their end values outside;
// squareness terms continue. All functions are those for approach in + direction. An undetermined parameter is not
// assumed to be 0: if a result depends on it, the result is NaN and `missing` names the parameter. Lengths in mm,
// angles in rad, machine frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

// The calibration with another covariance of its values, such as a propagated one, and with the corresponding standard
// uncertainties. Throws InvalidArgument as check(Calibration).
Calibration with_covariance(Calibration calibration, const Eigen::MatrixXd& covariance);

// Deviations X, Y, Z of the functional point, mm, and A, B, C of the tool's orientation, rad.
inline constexpr int deviation_count = 6;
inline constexpr std::array<const char*, deviation_count> deviation_names = {"X", "Y", "Z", "A", "B", "C"};
using Deviations = Eigen::Matrix<double, deviation_count, 1>;

// Coefficients of the six deviations (rows) for each entry of the calibration (columns).
struct DeviationRows {
    Eigen::Matrix<double, deviation_count, Eigen::Dynamic> rows;
    // Parameters with an influence at this point that the calibration does not have: "EAX", "slope of EXX", "C0Y".
    std::array<std::vector<std::string>, deviation_count> missing;
};
DeviationRows deviation_rows(const Calibration& calibration, const Eigen::Vector3d& tool, const Eigen::Vector3d& point);

struct ErrorAtPoint {
    Eigen::Vector3d point;                                               // commanded, mm
    Eigen::Vector3d tool;                                                // offset of the functional point, mm
    Deviations value;                                                    // NaN if a parameter is missing
    Eigen::Matrix<double, deviation_count, deviation_count> covariance;  // NaN also if the calibration has none
    std::array<std::vector<std::string>, deviation_count> missing;

    Deviations standard_uncertainty() const;
};
// `point`: commanded, mm. `tool`: offset of the functional point, mm; by default that of the calibration. Throws
// InvalidArgument for lengths that are not finite.
ErrorAtPoint error_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                            const std::optional<Eigen::Vector3d>& tool = {});

// Errors along a body diagonal (ISO 230-6): actual minus commanded distance of the functional point from the start of
// the diagonal, measured along the diagonal. The points divide the diagonal like the nodes of the axis with the most
// nodes.
struct DiagonalErrors {
    Line line;
    Eigen::Matrix<double, Eigen::Dynamic, 3> point;  // commanded, mm
    Eigen::VectorXd travel;                          // commanded distance from the start, mm
    Eigen::VectorXd value;                           // mm; NaN if a parameter is missing
    Eigen::MatrixXd covariance;                      // mm^2; NaN also if the calibration has none
    std::vector<std::string> missing;

    Eigen::VectorXd standard_uncertainty() const;
    double range() const;  // largest minus smallest value, mm; volumetric_accuracy() gives its uncertainty
};
// For the diagonals ppp, npp, pnp, nnp.
std::array<DiagonalErrors, 4> diagonal_errors(const Calibration& calibration,
                                              const std::optional<Eigen::Vector3d>& tool = {});

// Outputs for virtual calibrations with the same entries as `calibration`: X, Y, Z, A, B, C at a point, and the errors
// at the points of the four body diagonals. Outputs with a missing parameter are omitted.
std::vector<DerivedOutput> derived_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                                            const std::optional<Eigen::Vector3d>& tool = {});
std::vector<DerivedOutput> derived_on_diagonals(const Calibration& calibration,
                                                const std::optional<Eigen::Vector3d>& tool = {});

}  // namespace stepdiag
