#include "monte_carlo/coverage_intervals.hpp"

#include <algorithm>
#include <numeric>

namespace stepdiag {

CountedValues::CountedValues(const OutputBins& bins, const std::uint32_t* counts, double lowest, double highest) {
    const std::uint32_t last = bins.bins + 1;
    const std::uint64_t total = std::accumulate(counts, counts + last + 1, std::uint64_t(0));
    edges_.reserve(last + 2);
    below_.reserve(last + 2);
    edges_.push_back(lowest);
    below_.push_back(0.0);
    std::uint64_t below = 0;
    for (std::uint32_t i = 0; below < total; ++i) {
        below += counts[i];
        if (below == 0) continue;
        const double end = i < last ? bins.lower + double(i) * bins.width : highest;
        edges_.push_back(std::clamp(end, lowest, highest));
        below_.push_back(double(below));
    }
    edges_.back() = highest;
}

double CountedValues::at_rank(double rank, std::size_t& above) const {
    while (above + 1 < below_.size() && below_[above] < rank) ++above;
    const double from = below_[above - 1], to = below_[above];
    if (!(to > from)) return edges_[above];
    return edges_[above - 1] + std::min((rank - from) / (to - from), 1.0) * (edges_[above] - edges_[above - 1]);
}

double CountedValues::quantile(double probability) const {
    const double rank = probability * below_.back();
    const auto found = std::lower_bound(below_.begin() + 1, below_.end(), rank);
    std::size_t above = std::size_t(found - below_.begin());
    return at_rank(rank, above);
}

Eigen::RowVector2d CountedValues::symmetric_interval(double coverage) const {
    return {quantile(0.5 * (1.0 - coverage)), quantile(0.5 * (1.0 + coverage))};
}

// The shortest interval that contains the share `coverage` has an end at the edge of a bin.
Eigen::RowVector2d CountedValues::shortest_interval(double coverage) const {
    const double total = below_.back(), inside = coverage * total;
    Eigen::RowVector2d shortest(edges_.front(), edges_.back());
    const auto offer = [&](double low, double high) {
        if (high - low < shortest[1] - shortest[0]) shortest = {low, high};
    };
    std::size_t above = 1;
    for (std::size_t i = 0; i < edges_.size() && below_[i] + inside <= total; ++i)
        offer(edges_[i], at_rank(below_[i] + inside, above));
    above = 1;
    for (std::size_t i = 0; i < edges_.size(); ++i)
        if (below_[i] >= inside) offer(at_rank(below_[i] - inside, above), edges_[i]);
    return shortest;
}

}  // namespace stepdiag
