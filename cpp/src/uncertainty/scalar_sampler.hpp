// One sample of a virtual run, reading by reading: every pass read (simulation/pass_reader.hpp) with the sample's own
// head, set-up and air at the sample's own tool poses. This is the definition: simd_sampler, which is faster, is
// checked against it and falls back on it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "uncertainty/run_model.hpp"

namespace stepdiag {

// How the tool of a row stands out of where the machine's errors put it: turned about the functional point, in the
// machine frame.
struct Displacement {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
};

class ScalarSampler {
public:
    explicit ScalarSampler(const RunModel& model);

    // Raw readings: [row * channels + channel], NaN where lost. Reading noise with a sample, none without.
    Eigen::VectorXd readings(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample) const;
    // The same of one row of each pass, without noise, each traced as a whole; a row each, NaN where lost.
    Eigen::MatrixXd trace(const Eigen::VectorXd& deviations, std::uint64_t sample,
                          const std::vector<std::size_t>& rows) const;

private:
    using Readers = std::map<const Head*, std::shared_ptr<const TracedReader>>;

    std::vector<Displacement> displacements(const Eigen::VectorXd& deviations,
                                            std::optional<std::uint64_t> sample) const;
    Readers readers(double verified_share) const;  // that are the same in all samples
    // `readers`: of the heads of this sample, as far as their optics have been put together.
    Eigen::MatrixXd read(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample, const RunPass& pass,
                         const std::vector<std::size_t>& rows, const std::vector<Displacement>& displaced,
                         double verified_share, Readers& readers) const;
    void add_noise(std::uint64_t sample, Eigen::VectorXd& readings) const;

    const RunModel& model_;
    // Of the heads that are the same in all samples, by verified share.
    std::map<double, Readers> traced_;
};

}  // namespace stepdiag
