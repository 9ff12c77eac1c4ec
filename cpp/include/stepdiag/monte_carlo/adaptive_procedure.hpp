// Adaptive Monte Carlo procedure (JCGM 101:2008, 7.9.4), which chooses the number of samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

// Computes blocks of M = max(J, 10^4) samples, rounded up to whole leaves. J is the smallest integer of at least
// 100/(1 - p) for the coverage probability p. The procedure ends if twice the standard deviation of the average over
// the blocks is at most delta (numerical_tolerance) for the mean, u, and both ends of the symmetric coverage interval
// of every output.
class AdaptiveProcedure {
public:
    explicit AdaptiveProcedure(const Bins& bins);

    static std::uint64_t leaves_per_block(double coverage);
    LeafRange next_block() const;
    std::uint64_t blocks() const { return blocks_; }

    // Adds the next block, and merges it into `all`. Throws InvalidArgument for leaves other than next_block(), and for
    // a block without any result.
    void add(const PartialStatistics& block, PartialStatistics& all);

    // `all`: all blocks so far. delta follows from their u.
    Stability stability(const PartialStatistics& all) const;
    MonteCarloResult result(const PartialStatistics& all) const;  // includes the stability

    std::string to_bytes() const;
    static AdaptiveProcedure from_bytes(std::string_view bytes);

private:
    Bins bins_;
    std::uint64_t blocks_ = 0;
    Eigen::ArrayX4d average_, squares_;  // average and sum of squared deviations over the blocks (Welford)
};

}  // namespace stepdiag
