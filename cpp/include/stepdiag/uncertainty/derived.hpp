// What follows from a calibration: the error of the tool at any point and along the body diagonals (ISO 230-6), with
// uncertainty from the covariance of the calibration's values; ranges over the volume: volume_ranges.hpp.
//   e = sum_a (delta_a + theta_a x L_a),  orientation = sum_a theta_a   (machine/machine.hpp, to first order)
// is linear in the calibration's entries: functions linear between nodes, end values outside, squareness terms go on.
// Functions are those of nodes approached in + direction. What a calibration left undetermined is not taken as 0: where
// it matters the result is NaN, and `missing` names it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

// The calibration with another covariance of its values, such as one that was propagated to them, and the standard
// uncertainties that go with it. Throws InvalidArgument as check(Calibration).
Calibration with_covariance(Calibration calibration, const Eigen::MatrixXd& covariance);

// X, Y, Z: deviations of the functional point, mm; A, B, C: of the tool's orientation, rad.
inline constexpr int deviation_count = 6;
inline constexpr std::array<const char*, deviation_count> deviation_names = {"X", "Y", "Z", "A", "B", "C"};
using Deviations = Eigen::Matrix<double, deviation_count, 1>;

// Coefficients of the six deviations by entry.
struct DeviationRows {
    Eigen::Matrix<double, deviation_count, Eigen::Dynamic> rows;
    // Parameters that would act there and are not in the calibration: "EAX", "slope of EXX", "C0Y".
    std::array<std::vector<std::string>, deviation_count> missing;
};
DeviationRows deviation_rows(const Calibration& calibration, const Eigen::Vector3d& tool, const Eigen::Vector3d& point);

struct ErrorAtPoint {
    Eigen::Vector3d point;                                               // commanded, mm
    Eigen::Vector3d tool;                                                // offset of the functional point, mm
    Deviations value;                                                    // NaN where something is missing
    Eigen::Matrix<double, deviation_count, deviation_count> covariance;  // NaN also where the calibration has none
    std::array<std::vector<std::string>, deviation_count> missing;

    Deviations standard_uncertainty() const;
};
// `tool`: none: the one of the calibration. Throws InvalidArgument for lengths that are not finite.
ErrorAtPoint error_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                            const std::optional<Eigen::Vector3d>& tool = {});

// Along a body diagonal: how much further than commanded the functional point is from where the diagonal begins, along
// the diagonal, at points that divide it like the nodes of the finest axis.
struct DiagonalErrors {
    Line line;
    Eigen::Matrix<double, Eigen::Dynamic, 3> point;  // commanded, mm
    Eigen::VectorXd travel;                          // commanded, mm
    Eigen::VectorXd value;                           // mm; NaN where something is missing
    Eigen::MatrixXd covariance;                      // mm^2; NaN also where the calibration has none
    std::vector<std::string> missing;

    Eigen::VectorXd standard_uncertainty() const;
    double range() const;  // largest less smallest; its uncertainty: volumetric_accuracy()
};
// Of the diagonals ppp, npp, pnp, nnp.
std::array<DiagonalErrors, 4> diagonal_errors(const Calibration& calibration,
                                              const std::optional<Eigen::Vector3d>& tool = {});

// Outputs for virtual calibrations that give `calibration` as pattern: X, Y, Z, A, B, C at points, deviations along the
// four body diagonals at their points. Those that something is missing for are left out.
std::vector<DerivedOutput> derived_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                                            const std::optional<Eigen::Vector3d>& tool = {});
std::vector<DerivedOutput> derived_on_diagonals(const Calibration& calibration,
                                                const std::optional<Eigen::Vector3d>& tool = {});

}  // namespace stepdiag
