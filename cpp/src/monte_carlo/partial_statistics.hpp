// Content of PartialStatistics. Internal.
#pragma once

#include "monte_carlo/bins.hpp"
#include "monte_carlo/moment_tree.hpp"

namespace stepdiag {

struct PartialStatistics::State {
    Bins bins;
    MomentTree tree;
    Counts counts;
};

Eigen::VectorXd standard_uncertainties(const PartialStatistics::State& state);
// Mean, standard uncertainty and both ends of the symmetric interval of each output; NaN for too few samples.
Eigen::ArrayX4d main_figures(const PartialStatistics::State& state);

}  // namespace stepdiag
