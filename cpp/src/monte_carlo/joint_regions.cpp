#include "monte_carlo/joint_regions.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

double total_of(const std::vector<std::uint32_t>& counts) {
    return double(std::accumulate(counts.begin(), counts.end(), std::uint64_t(0)));
}

// Quantile `coverage` of the counted distances. Distances beyond the bins are spread evenly up to the farthest one.
double distance_quantile(const std::vector<std::uint32_t>& counts, double farthest, double coverage) {
    const double rank = coverage * total_of(counts);
    double below = 0.0;
    std::size_t i = 0;
    while (i < distance_bins && below + counts[i] < rank) below += counts[i++];
    if (counts[i] == 0) return std::numeric_limits<double>::quiet_NaN();
    const double from = double(i) * distance_width;
    const double to = std::min(i < distance_bins ? from + distance_width : farthest, farthest);
    return from + (rank - below) / counts[i] * (to - from);
}

double unit_ball(Eigen::Index dimensions) { return dimensions == 1 ? 2.0 : dimensions == 2 ? pi : 4.0 / 3.0 * pi; }

// Chooses the fullest cells until they contain the coverage. For equal counts, the first cell is chosen.
void choose_cells(const JointCounts& counts, double coverage, JointRegion& region) {
    const std::size_t cells = counts.cells.size() - 1;
    std::vector<std::uint32_t> order(cells);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return counts.cells[a] > counts.cells[b]; });
    const double total = total_of(counts.cells);
    region.smallest.assign(cells, false);
    double inside = 0.0, chosen = 0.0;
    for (std::size_t i = 0; i < cells && inside < coverage * total && counts.cells[order[i]] > 0; ++i) {
        region.smallest[order[i]] = true;
        inside += counts.cells[order[i]];
        chosen += 1.0;
    }
    region.smallest_share = inside / total;
    region.smallest_volume = chosen * region.grid_width.prod();
}

}  // namespace

JointRegion joint_region(const JointBins& bins, const JointCounts& counts, double coverage) {
    const Eigen::Index size = Eigen::Index(bins.outputs.size());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    JointRegion region{bins.outputs,   bins.centre,     bins.covariance, nan, nan, nan, nan,
                       bins.grid_from, bins.grid_width, bins.cells,      {},  nan, nan};
    region.rectangle_factor = distance_quantile(counts.rectangle, counts.farthest_rectangle, coverage);
    region.rectangle_volume = (2.0 * region.rectangle_factor * bins.covariance.diagonal().cwiseSqrt()).prod();
    if (bins.whitening.rows() > 0) {
        region.ellipsoid_factor = distance_quantile(counts.ellipsoid, counts.farthest_ellipsoid, coverage);
        region.ellipsoid_volume =
            unit_ball(size) * std::pow(region.ellipsoid_factor, double(size)) / bins.whitening.diagonal().prod();
    }
    choose_cells(counts, coverage, region);
    return region;
}

}  // namespace stepdiag
