// As many samples as the figures need: the adaptive procedure of JCGM 101 (7.9.4).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

// The adaptive procedure (JCGM 101, 7.9.4): blocks of M = max(J, 10^4) samples, J the smallest whole number that is
// 100/(1 - p) or more, rounded up to whole leaves, until twice the standard deviation of the average over blocks is no
// more than delta for mean, u, and both ends of the symmetric interval of every output.
class AdaptiveProcedure {
public:
    explicit AdaptiveProcedure(const Bins& bins);

    static std::uint64_t leaves_per_block(double coverage);
    LeafRange next_block() const;
    std::uint64_t blocks() const { return blocks_; }

    // The next block, which is also merged into `all`. Throws InvalidArgument for leaves other than next_block().
    void add(const PartialStatistics& block, PartialStatistics& all);

    // delta is that of u over `all` blocks so far.
    Stability stability(const PartialStatistics& all) const;
    MonteCarloResult result(const PartialStatistics& all) const;  // with it

    std::string to_bytes() const;
    static AdaptiveProcedure from_bytes(std::string_view bytes);

private:
    Bins bins_;
    std::uint64_t blocks_ = 0;
    Eigen::ArrayX4d average_, squares_;  // of the figures: average, sum of squared deviations from it (Welford)
};

}  // namespace stepdiag
