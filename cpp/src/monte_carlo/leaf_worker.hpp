// Evaluates one leaf of samples in blocks that fit a core's cache, sums their outputs, and counts them in bins when the
// leaf is complete. Internal.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "monte_carlo/bins.hpp"
#include "monte_carlo/moment_tree.hpp"
#include "monte_carlo/sum_and_bin.hpp"

namespace stepdiag {

// Number of samples in a block, a multiple of lane_group.
std::size_t block_samples(std::size_t outputs);

// Working memory of one thread. In addition to the block it takes, for each sample of a leaf, 2 bytes for each output
// and 8 bytes for each output whose values are needed again (all outputs for a covariance).
class LeafWorker {
public:
    LeafWorker(const SampleModel& model, const Bins::Content& bins);

    // Evaluates a leaf and adds to `counts`. If stopped before the end of the leaf, returns nothing and adds nothing.
    std::optional<Moments> run(std::uint64_t leaf, Counts& counts, const std::atomic<bool>& stop);

private:
    void add_block(std::uint64_t first_sample, std::size_t samples);
    std::size_t leave_out_lost(std::uint64_t first_sample, std::size_t samples);
    void count(std::uint64_t leaf, Counts& counts) const;
    void count_joint(const JointBins& joint, JointCounts& counts) const;
    std::vector<double> kept() const;
    const double* values_of(std::size_t output) const { return gathered_.data() + place_[output] * leaf_samples; }

    const Bins::Content& bins_;
    std::unique_ptr<SampleModel::Worker> model_;
    std::vector<BinScale> scales_;
    std::vector<RowSums> block_sums_, sums_;
    std::vector<double> block_;
    std::vector<std::uint16_t> indices_;  // bins: outputs x leaf_samples; only the first `samples_` of a row are valid
    std::vector<std::size_t> gather_;     // outputs whose values are needed again
    std::vector<std::size_t> place_;      // for each output: its row in gathered_
    std::vector<double> gathered_;        // gather_ x leaf_samples
    std::vector<std::uint64_t> lost_;     // samples of the leaf without a result
    std::size_t samples_ = 0;             // samples with a result so far
    std::uint64_t first_sample_ = 0;
};

}  // namespace stepdiag
