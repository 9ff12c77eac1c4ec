// Coverage intervals from counts in bins (JCGM 101, 7.7). Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "monte_carlo/bins.hpp"

namespace stepdiag {

// Distribution function of counted values, linear within bins. Values outside the bins are spread evenly up to the
// lowest and the highest value.
class CountedValues {
public:
    // `counts`: values below the bins, bins, values above the bins. There must be at least one value.
    CountedValues(const OutputBins& bins, const std::uint32_t* counts, double lowest, double highest);

    double quantile(double probability) const;
    Eigen::RowVector2d symmetric_interval(double coverage) const;
    Eigen::RowVector2d shortest_interval(double coverage) const;

private:
    // The value with `rank` values below it. `above`: index of the upper edge of its bin; a search for a larger rank
    // starts there.
    double at_rank(double rank, std::size_t& above) const;
    std::vector<double> edges_, below_;  // edges of the bins from the lowest to the highest value; counts below each
};

}  // namespace stepdiag
