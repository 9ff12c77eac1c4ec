// Uncertainty of the ranges over a volume (volume_ranges.hpp), by the Monte Carlo method with draws from the joint
// normal distribution of a calibration's values.
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

// Model of the ranges for the Monte Carlo method. Outputs are the ranges of range_names without a missing parameter.
class RangeModel : public SampleModel {
public:
    // Throws InvalidArgument for a calibration without covariance.
    RangeModel(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool = {}, std::uint64_t seed = 0);
    ~RangeModel() override;

    const std::vector<Output>& outputs() const override;
    std::uint64_t seed() const override;
    std::string target() const override;  // "scalar": no SIMD
    std::unique_ptr<Worker> worker() const override;

private:
    struct State;
    std::shared_ptr<const State> state_;
};

// Ranges with their uncertainty. A range is not linear in the values, and noise increases it. The draws about the
// values of the calibration show by how much.
struct VolumetricAccuracy {
    Ranges value;                 // of the calibration's values
    Ranges mean;                  // of the draws
    Ranges standard_uncertainty;  // standard deviation of the draws
    // Probabilistically symmetric coverage interval of the draws: lower and upper ends as columns. It has the same bias
    // as the values.
    Eigen::Matrix<double, range_count, 2> drawn_interval;
    // Interval reflected about the value, 2 value - drawn_interval, which removes the bias to first order; not below 0.
    Eigen::Matrix<double, range_count, 2> interval;
    // Quantile of the range of noise only. Because |V(found) - V(true)| <= V(found - true), the true range is within
    // value +- bound with at least the coverage probability.
    Ranges bound;
    double resolution;  // mm; see VolumeRanges
    std::array<std::vector<std::string>, range_count> missing;
    std::size_t samples;

    Ranges bias() const { return mean - value; }
};
struct RangeOptions {
    double coverage = 0.95;
    std::size_t samples = 10'000;
    std::uint64_t seed = 0;
};
// Throws InvalidArgument for a calibration without covariance, a coverage probability outside (0, 1), or fewer samples
// than 100/(1 - coverage).
VolumetricAccuracy volumetric_accuracy(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool = {},
                                       const RangeOptions& options = {});

}  // namespace stepdiag
