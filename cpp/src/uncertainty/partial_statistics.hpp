// What PartialStatistics hold. Internal.
#pragma once

#include "uncertainty/bins.hpp"
#include "uncertainty/moment_tree.hpp"

namespace stepdiag {

struct PartialStatistics::State {
    Bins bins;
    MomentTree tree;
    Counts counts;
};

Eigen::VectorXd standard_uncertainties(const PartialStatistics::State& state);

}  // namespace stepdiag
