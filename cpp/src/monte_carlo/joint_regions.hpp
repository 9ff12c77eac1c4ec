// Joint coverage regions from counts (JCGM 102, 6.5 and 7.7). Internal.
#pragma once

#include "monte_carlo/bins.hpp"

namespace stepdiag {

JointRegion joint_region(const JointBins& bins, const JointCounts& counts, double coverage);

}  // namespace stepdiag
