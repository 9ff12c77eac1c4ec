// One leaf of samples: evaluated in blocks that stay in a core's cache, summed, and put into bins when it is whole.
// Internal.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "monte_carlo/bins.hpp"
#include "monte_carlo/moment_tree.hpp"
#include "monte_carlo/sum_and_bin.hpp"

namespace stepdiag {

// Samples of a block: a multiple of lane_group.
std::size_t block_samples(std::size_t outputs);

// What one thread holds. Beside the block: 2 bytes for each output and sample of a leaf, and 8 for each output whose
// values are needed again (all of them for a covariance).
class LeafWorker {
public:
    LeafWorker(const SampleModel& model, const Bins::Content& bins);

    // Counts into `counts`, unless stopped before the leaf's end: then nothing.
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
    std::vector<std::uint16_t> indices_;  // outputs x leaf_samples; the first `samples_` of each count
    std::vector<std::size_t> gather_;     // outputs whose values are needed
    std::vector<std::size_t> place_;      // by output: its row in gathered_
    std::vector<double> gathered_;        // gather_ x leaf_samples
    std::vector<std::uint64_t> lost_;     // within the leaf
    std::size_t samples_ = 0;             // with a result, so far
    std::uint64_t first_sample_ = 0;
};

}  // namespace stepdiag
