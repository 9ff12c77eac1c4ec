// A route prepared for replay.cpp: values common to all lanes are copied next to each other, the others are pointers.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stepdiag/optics/replay.hpp"

namespace stepdiag {

// Values of successive lanes start at from + (lane & mask). The mask is all ones, or 0 for an array of copies of one
// common value.
struct LaneSource {
    const double* from;
    std::size_t mask;
};

struct PreparedEncounter {
    Event event;
    bool deflects;
    bool plane_by_lane, indices_by_lane;
    const Outline* outline;
    double plane[12];                                   // if common to all lanes: rotation and translation,
    double index_before, index_after, one_less_ratio2;  // n1, n2, 1 - (n1/n2)^2,
    double inverse_index, index_ratio;                  // 1/n1, n1/n2
    LaneSource plane_from[12];                          // if different for each lane
    LaneSource index_before_from, index_after_from;
};

class PreparedRoute {
public:
    // Prepares reading of `width` lanes at a time. Fewer lanes than `width` are copied and padded with the last one.
    // Throws InvalidArgument for a stride other than 0 and 1.
    PreparedRoute(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, std::size_t width);

    LaneSource start[8];  // origin, direction, optical and reduced length
    PreparedEncounter* begin() const { return encounters_.get(); }
    PreparedEncounter* end() const { return encounters_.get() + size_; }

private:
    void prepare(const Encounter& encounter, PreparedEncounter& made);
    LaneSource source(const LaneValue& value);

    std::size_t lanes_, width_, size_;
    // Both are left uninitialised, so that a call for one lane does not pay for hundreds.
    std::unique_ptr<PreparedEncounter[]> encounters_;
    std::unique_ptr<double[]> rows_;
    double* next_row_;
};

// Temporary results of up to 64 lanes.
struct ResultsAside {
    double number[8][64];
    std::uint8_t followed[64];
    LaneResults results{
        {number[0], number[1], number[2]}, {number[3], number[4], number[5]}, number[6], number[7], followed};
};

LaneResults from_lane(const LaneResults& results, std::size_t lane);
void copy(const LaneResults& from, std::size_t lanes, const LaneResults& to);

}  // namespace stepdiag
