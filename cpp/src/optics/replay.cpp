#include "stepdiag/optics/replay.hpp"

#include <algorithm>

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "optics/replay.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set

// The vector type must precede the code that uses it:
#include "core/simd-inl.hpp"
//
#include "optics/encounter-inl.hpp"
#include "optics/prepared_route.hpp"
#include "stepdiag/core/error.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// Numbers of an encounter for `meet`, for the case that they are common to all lanes.
struct CommonFace {
    const PreparedEncounter& encounter;
    std::size_t lane;

    STEPDIAG_INLINE Pair by_lane(const LaneSource& source) const { return load(source.from + (lane & source.mask)); }
    STEPDIAG_INLINE Pair rotation(int k) const { return all(encounter.plane[k]); }
    STEPDIAG_INLINE Pair translation(int k) const { return all(encounter.plane[9 + k]); }
    STEPDIAG_INLINE Pair index() const { return all(encounter.index_before); }
    STEPDIAG_INLINE Pair inverse_index() const { return all(encounter.inverse_index); }
    STEPDIAG_INLINE Pair index_ratio() const { return all(encounter.index_ratio); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return all(encounter.one_less_ratio2); }
};

// The same if each lane has its own plane.
struct PlaneByLane : CommonFace {
    STEPDIAG_INLINE Pair rotation(int k) const { return by_lane(encounter.plane_from[k]); }
    STEPDIAG_INLINE Pair translation(int k) const { return by_lane(encounter.plane_from[9 + k]); }
};

// The same if each lane has its own plane and indices.
struct FaceByLane : PlaneByLane {
    STEPDIAG_INLINE Pair index() const { return by_lane(encounter.index_before_from); }
    STEPDIAG_INLINE Pair inverse_index() const { return all(1.0) / index(); }
    STEPDIAG_INLINE Pair index_ratio() const { return index() / by_lane(encounter.index_after_from); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return sub_mul(index_ratio(), index_ratio(), all(1.0)); }
};

// Uses the same operations as FaceByLane to get the same bits.
void prepare_indices(const PreparedRoute& route) {
    for (PreparedEncounter& encounter : route) {
        const Vector ratio = hn::Set(Tag(), encounter.index_ratio);
        if (!encounter.indices_by_lane)
            encounter.one_less_ratio2 = hn::GetLane(sub_mul(ratio, ratio, hn::Set(Tag(), 1.0)));
    }
}

// Processes one pair of vectors, starting with `lane`. Writes results to to.point[0][at] and the following elements.
void follow(const PreparedRoute& route, std::size_t lane, double gap, const LaneResults& to, std::size_t at) {
    const auto start = [&](int k) HWY_ATTR { return load(route.start[k].from + (lane & route.start[k].mask)); };
    const Pair nearest = all(gap);
    Light<Pair> light{{start(0), start(1), start(2)}, {start(3), start(4), start(5)}, start(6), start(7), all_true()};
    for (const PreparedEncounter& encounter : route) {
        const CommonFace face{encounter, lane};
        if (encounter.indices_by_lane) meet(encounter, FaceByLane{{face}}, nearest, light);
        else if (encounter.plane_by_lane) meet(encounter, PlaneByLane{face}, nearest, light);
        else meet(encounter, face, nearest, light);
    }
    check_end(light);
    for (int k = 0; k < 3; ++k)
        store(light.point[k], to.point[k] + at), store(light.direction[k], to.direction[k] + at);
    store(light.optical_length, to.optical_length + at);
    store(light.reduced_length, to.reduced_length + at);
    store(light.followed, to.followed + at);
}

void replay_lanes(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
                  const LaneResults& results) {
    const std::size_t width = 2 * hn::Lanes(Tag());
    PreparedRoute prepared(route, rays, lanes, width);
    prepare_indices(prepared);
    // If the lanes do not fill the last pair of vectors, process a pair that ends with the last lane. Do this first,
    // because results may overwrite the input rays.
    const std::size_t left = lanes % width;
    ResultsAside aside;
    if (left > 0) follow(prepared, std::max(lanes, width) - width, gap, aside.results, 0);
    for (std::size_t lane = 0; lane + width <= lanes; lane += width) follow(prepared, lane, gap, results, lane);
    if (left > 0)
        copy(from_lane(aside.results, lanes < width ? 0 : width - left), left, from_lane(results, lanes - left));
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(replay_lanes);

}  // namespace

void replay(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
            const LaneResults& results) {
    if (lanes > 0) HWY_DYNAMIC_DISPATCH(replay_lanes)(route, rays, lanes, gap, results);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
