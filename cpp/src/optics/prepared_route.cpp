#include "optics/prepared_route.hpp"

#include <algorithm>
#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

bool varies(const LaneValue& value) {
    if (value.stride != 0 && value.stride != 1)
        throw InvalidArgument("replay: expected a stride of 0 or 1, got " + std::to_string(value.stride));
    return value.stride != 0;
}

bool reads_both_indices(const Encounter& encounter) {
    return encounter.event == Event::totally_reflected || (encounter.event == Event::refracted && encounter.deflects);
}

}  // namespace

PreparedRoute::PreparedRoute(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes,
                             std::size_t width, std::size_t padded_below)
    : lanes_(lanes),
      width_(width),
      padded_(lanes < padded_below),
      rows_(new double[(14 * route.size() + 8) * width]),
      next_row_(rows_.get()) {
    for (int k = 0; k < 3; ++k) start[k] = source(rays.origin[k]), start[3 + k] = source(rays.direction[k]);
    start[6] = source(rays.optical_length);
    start[7] = source(rays.reduced_length);

    encounters.resize(route.size());
    for (std::size_t i = 0; i < route.size(); ++i) {
        const Encounter& encounter = route[i];
        PreparedEncounter& made = encounters[i];
        made.event = encounter.event;
        made.deflects = encounter.deflects;
        made.outline = encounter.outline;

        made.plane_by_lane = false;
        const auto plane = [&](int k) { return k < 9 ? encounter.rotation[k] : encounter.translation[k - 9]; };
        for (int k = 0; k < 12; ++k) made.plane_by_lane |= varies(plane(k));
        for (int k = 0; k < 12; ++k)
            if (made.plane_by_lane) made.numbers[k] = source(plane(k));
            else made.plane[k] = *plane(k).value;

        const LaneValue& before = encounter.index_before;
        const LaneValue& after = reads_both_indices(encounter) ? encounter.index_after : before;
        made.indices_by_lane = varies(before) || varies(after);
        if (made.indices_by_lane) {
            made.numbers[PreparedEncounter::index_before] = source(before);
            made.numbers[PreparedEncounter::index_after] = source(after);
        } else {
            made.index_before_after[0] = *before.value;
            made.index_before_after[1] = *after.value;
        }
    }
}

LaneSource PreparedRoute::source(const LaneValue& value) {
    if (varies(value) && !padded_) return {value.value, ~std::size_t(0)};
    double* const row = next_row_;
    next_row_ += width_;
    for (std::size_t i = 0; i < width_; ++i) row[i] = value.value[value.stride ? std::min(i, lanes_ - 1) : 0];
    return {row, 0};
}

}  // namespace stepdiag
