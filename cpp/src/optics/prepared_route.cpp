#include "optics/prepared_route.hpp"

#include <algorithm>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Whether at least one value varies from lane to lane.
template <std::size_t size>
bool vary(const std::array<LaneValue, size>& values) {
    bool any = false;
    for (const LaneValue& value : values) {
        if (value.stride != 0 && value.stride != 1)
            throw InvalidArgument("replay: expected a stride of 0 or 1, got " + std::to_string(value.stride));
        any |= value.stride != 0;
    }
    return any;
}

bool reads_both_indices(const Encounter& encounter) {
    return encounter.event == Event::totally_reflected || (encounter.event == Event::refracted && encounter.deflects);
}

}  // namespace

PreparedRoute::PreparedRoute(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes,
                             std::size_t width)
    : lanes_(lanes),
      width_(width),
      size_(route.size()),
      encounters_(new PreparedEncounter[size_]),
      rows_(new double[(14 * size_ + 8) * width]),
      next_row_(rows_.get()) {
    vary(rays.origin), vary(rays.direction), vary(std::array{rays.optical_length, rays.reduced_length});
    for (int k = 0; k < 3; ++k) start[k] = source(rays.origin[k]), start[3 + k] = source(rays.direction[k]);
    start[6] = source(rays.optical_length);
    start[7] = source(rays.reduced_length);
    for (std::size_t i = 0; i < size_; ++i) prepare(route[i], encounters_[i]);
}

void PreparedRoute::prepare(const Encounter& encounter, PreparedEncounter& made) {
    made.event = encounter.event;
    made.deflects = encounter.deflects;
    made.outline = encounter.outline;

    const LaneValue& before = encounter.index_before;
    const LaneValue& after = reads_both_indices(encounter) ? encounter.index_after : before;
    made.indices_by_lane = vary(std::array{before, after});
    if (made.indices_by_lane) {
        made.index_before_from = source(before);
        made.index_after_from = source(after);
    } else {
        made.index_before = *before.value;
        made.index_after = *after.value;
        made.inverse_index = 1.0 / made.index_before;
        made.index_ratio = made.index_before / made.index_after;
    }

    // Two kinds of varying faces suffice: if the indices vary, the plane is read per lane as well.
    const bool rotation_varies = vary(encounter.rotation), translation_varies = vary(encounter.translation);
    made.plane_by_lane = rotation_varies || translation_varies || made.indices_by_lane;
    if (made.plane_by_lane) {
        for (int k = 0; k < 9; ++k) made.plane_from[k] = source(encounter.rotation[k]);
        for (int k = 0; k < 3; ++k) made.plane_from[9 + k] = source(encounter.translation[k]);
    } else {
        for (int k = 0; k < 9; ++k) made.plane[k] = *encounter.rotation[k].value;
        for (int k = 0; k < 3; ++k) made.plane[9 + k] = *encounter.translation[k].value;
    }
}

LaneSource PreparedRoute::source(const LaneValue& value) {
    if (value.stride != 0 && lanes_ >= width_) return {value.value, ~std::size_t(0)};
    double* const row = next_row_;
    next_row_ += width_;
    const std::size_t given = value.stride != 0 ? std::min(lanes_, width_) : 1;
    for (std::size_t i = 0; i < given; ++i) row[i] = value.value[i];
    for (std::size_t i = given; i < width_; ++i) row[i] = row[given - 1];
    return {row, 0};
}

LaneResults from_lane(const LaneResults& results, std::size_t lane) {
    LaneResults to = results;
    for (int k = 0; k < 3; ++k) to.point[k] += lane, to.direction[k] += lane;
    to.optical_length += lane, to.reduced_length += lane, to.followed += lane;
    return to;
}

void copy(const LaneResults& from, std::size_t lanes, const LaneResults& to) {
    for (int k = 0; k < 3; ++k) {
        std::copy_n(from.point[k], lanes, to.point[k]);
        std::copy_n(from.direction[k], lanes, to.direction[k]);
    }
    std::copy_n(from.optical_length, lanes, to.optical_length);
    std::copy_n(from.reduced_length, lanes, to.reduced_length);
    std::copy_n(from.followed, lanes, to.followed);
}

}  // namespace stepdiag
