// The uncertainty of the ranges over a volume, by draws from the joint normal distribution of a calibration's values.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/monte_carlo/sample_model.hpp"
#include "stepdiag/uncertainty/volume_ranges.hpp"

namespace stepdiag {

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

}  // namespace stepdiag
