// Coverage intervals from counts in bins (JCGM 101, 7.7). Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "monte_carlo/bins.hpp"

namespace stepdiag {

// The distribution function of counted values, linear within bins; those beyond the bins spread to the lowest and the
// highest value.
class CountedValues {
public:
    // `counts`: those below the bins, the bins, those above. At least one value.
    CountedValues(const OutputBins& bins, const std::uint32_t* counts, double lowest, double highest);

    double quantile(double probability) const;
    Eigen::RowVector2d symmetric_interval(double coverage) const;
    Eigen::RowVector2d shortest_interval(double coverage) const;

private:
    // The value with `rank` values below it; `above`: the end of its bin, from where a greater rank is looked for.
    double at_rank(double rank, std::size_t& above) const;
    std::vector<double> edges_, below_;  // edges of bins, from the lowest to the highest value; counts below each
};

}  // namespace stepdiag
