// A route as replay.cpp walks it: what is common to all lanes copied side by side, the rest as pointers.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stepdiag/optics/replay.hpp"

namespace stepdiag {

// Values of successive lanes start at from + (lane & mask): the mask is all ones, or 0 for a row of copies of one
// value.
struct LaneSource {
    const double* from;
    std::size_t mask;
};

struct PreparedEncounter {
    Event event;
    bool deflects;
    bool plane_by_lane, indices_by_lane;
    const Outline* outline;
    double plane[12];                                   // where common: rotation and translation,
    double index_before, index_after, one_less_ratio2;  // and of the indices n1, n2, 1 - (n1/n2)^2
    double inverse_index, index_ratio;                  // 1/n1, n1/n2
    LaneSource plane_from[12];                          // where by lane
    LaneSource index_before_from, index_after_from;
};

class PreparedRoute {
public:
    // For vectors of up to `width` lanes, which may read beyond `lanes` only what is copied here: where there are fewer
    // lanes than `padded_below`, copies go on with the last lane. Throws InvalidArgument for strides other than 0
    // and 1.
    PreparedRoute(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, std::size_t width,
                  std::size_t padded_below);

    LaneSource start[8];  // origin, direction, optical and reduced length
    PreparedEncounter* begin() const { return encounters_.get(); }
    PreparedEncounter* end() const { return encounters_.get() + size_; }

private:
    void prepare(const Encounter& encounter, PreparedEncounter& made);
    LaneSource source(const LaneValue& value);

    std::size_t lanes_, width_, size_;
    bool padded_;
    // Both without initial values: a call for one lane should not cost that of hundreds.
    std::unique_ptr<PreparedEncounter[]> encounters_;
    std::unique_ptr<double[]> rows_;
    double* next_row_;
};

}  // namespace stepdiag
