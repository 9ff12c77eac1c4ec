// What follows from a calibration: the error of the tool at any point, of the body diagonals (ISO 230-6), and the
// volumetric accuracy V_XYZ (ISO 230-1:2012, clause 3), with uncertainty from the covariance of the calibration's
// values.
//   e = sum_a (delta_a + theta_a x L_a),  orientation = sum_a theta_a   (machine/machine.hpp, to first order)
// is linear in the calibration's entries: functions linear between nodes, end values outside, squareness terms go on.
// Functions are those of nodes approached in + direction. What a calibration left undetermined is not taken as 0: where
// it matters the result is NaN, and `missing` names it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

// The entries of a calibration in the order of Calibration::covariance, and their values.
std::vector<CalibrationEntry> calibration_entries(const Calibration& calibration);
Eigen::VectorXd calibration_values(const Calibration& calibration);

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

// Six ranges over the volume, of deviations relative to each other, and the ranges of the four diagonals' errors.
inline constexpr int range_count = deviation_count + 4;
using Ranges = Eigen::Matrix<double, range_count, 1>;
inline constexpr std::array<const char*, range_count> range_names = {"V_X", "V_Y",     "V_Z",     "V_A",     "V_B",
                                                                     "V_C", "E_D ppp", "E_D npp", "E_D pnp", "E_D nnp"};

// The ranges of tables with the nodes of a calibration. Between nodes deviations are linear in each position, so that
// their extremes are at nodes; but along an axis that carries the workpiece they are quadratic where a rotation
// changes, and that axis is divided more finely.
class VolumeRanges {
public:
    VolumeRanges(const Calibration& calibration, const Eigen::Vector3d& tool);
    ~VolumeRanges();
    VolumeRanges(VolumeRanges&&) noexcept;

    Ranges evaluate(const Eigen::VectorXd& values) const;  // NaN where something is missing
    // By how much the deviations between the grid's points may exceed those on it, mm, at these values.
    double resolution(const Eigen::VectorXd& values) const;
    const std::array<std::vector<std::string>, range_count>& missing() const;

private:
    struct Grid;
    std::unique_ptr<const Grid> grid_;
};

// A model of the ranges for the Monte Carlo method: draws from the joint normal distribution of a calibration's values.
// Outputs: those of range_names that nothing is missing for.
class RangeModel : public SampleModel {
public:
    // Throws InvalidArgument for a calibration without covariance.
    RangeModel(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool = {}, std::uint64_t seed = 0);
    ~RangeModel() override;

    const std::vector<Output>& outputs() const override;
    std::uint64_t seed() const override;
    std::string target() const override;  // "scalar": one after the other
    std::unique_ptr<Worker> worker() const override;

private:
    struct State;
    std::shared_ptr<const State> state_;
};

// A range is not linear in the values, and noise makes it larger: draws about the values found show by how much.
struct VolumetricAccuracy {
    Ranges value;                 // of the calibration's values
    Ranges mean;                  // of the draws
    Ranges standard_uncertainty;  // standard deviation of the draws
    // Of the draws, probabilistically symmetric: a column with the lower and one with the upper ends. They are as much
    // too large as the values are.
    Eigen::Matrix<double, range_count, 2> drawn_interval;
    // Mirrored about the value, 2 value - drawn_interval, which takes the bias off to first order; not below 0.
    Eigen::Matrix<double, range_count, 2> interval;
    // |V(found) - V(true)| <= V(found - true): with at least the coverage probability the true range is within
    // value -+ this, the quantile of the range of noise alone.
    Ranges bound;
    double resolution;  // mm: see VolumeRanges
    std::array<std::vector<std::string>, range_count> missing;
    std::size_t samples;

    Ranges bias() const { return mean - value; }
};
struct RangeOptions {
    double coverage = 0.95;
    std::size_t samples = 10'000;
    std::uint64_t seed = 0;
};
// Throws InvalidArgument for a calibration without covariance, a coverage probability outside 0 .. 1, fewer samples
// than 100/(1 - coverage).
VolumetricAccuracy volumetric_accuracy(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool = {},
                                       const RangeOptions& options = {});

// Outputs for virtual calibrations that give `calibration` as pattern: X, Y, Z, A, B, C at points, deviations along the
// four body diagonals at their points. Those that something is missing for are left out.
std::vector<DerivedOutput> derived_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                                            const std::optional<Eigen::Vector3d>& tool = {});
std::vector<DerivedOutput> derived_on_diagonals(const Calibration& calibration,
                                                const std::optional<Eigen::Vector3d>& tool = {});

}  // namespace stepdiag
