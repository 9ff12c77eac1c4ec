#include "stepdiag/optics/replay.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "optics/replay.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set

// Vectors before the physics that is calculated with them:
#include "optics/lanes-inl.hpp"
//
#include "optics/encounter-inl.hpp"
#include "optics/prepared_route.hpp"
#include "stepdiag/core/error.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// The numbers of an encounter as `meet` takes them, where they are the same for all lanes ...
template <class N>
struct CommonFace {
    const PreparedEncounter& encounter;
    std::size_t lane;

    HWY_INLINE N common(double value) const { return broadcast(Type<N>(), value); }
    HWY_INLINE N by_lane(const LaneSource& source) const { return load(Type<N>(), source.from + (lane & source.mask)); }
    HWY_INLINE N rotation(int k) const { return common(encounter.plane[k]); }
    HWY_INLINE N translation(int k) const { return common(encounter.plane[9 + k]); }
    HWY_INLINE N index() const { return common(encounter.index_before); }
    HWY_INLINE N inverse_index() const { return common(encounter.inverse_index); }
    HWY_INLINE N index_ratio() const { return common(encounter.index_ratio); }
    HWY_INLINE N one_less_ratio2() const { return common(encounter.one_less_ratio2); }
};

// ... where the plane is that of each lane ...
template <class N>
struct FaceByLane : CommonFace<N> {
    HWY_INLINE N rotation(int k) const { return this->by_lane(this->encounter.plane_from[k]); }
    HWY_INLINE N translation(int k) const { return this->by_lane(this->encounter.plane_from[9 + k]); }
};

// ... and where the indices are.
template <class N, class Plane>
struct IndicesByLane : Plane {
    HWY_INLINE N index() const { return this->by_lane(this->encounter.index_before_from); }
    HWY_INLINE N inverse_index() const { return this->common(1.0) / index(); }
    HWY_INLINE N index_ratio() const { return index() / this->by_lane(this->encounter.index_after_from); }
    HWY_INLINE N one_less_ratio2() const {
        const N ratio = index_ratio();
        return sub_mul(ratio, ratio, this->common(1.0));
    }
};

// By the operation that IndicesByLane takes, so that the bits are the same.
void prepare_indices(const PreparedRoute& route) {
    for (PreparedEncounter& encounter : route) {
        const Vector ratio = broadcast(Type<Vector>(), encounter.index_ratio);
        if (!encounter.indices_by_lane)
            encounter.one_less_ratio2 = hn::GetLane(sub_mul(ratio, ratio, broadcast(Type<Vector>(), 1.0)));
    }
}

// The lanes from `lane` on, as many as N holds; results go to to[0], to[1] ...
template <class N>
HWY_INLINE void follow(const PreparedRoute& route, std::size_t lane, double gap, const LaneResults& to) {
    const Type<N> n;
    N start[8];
    for (int k = 0; k < 8; ++k) start[k] = load(n, route.start[k].from + (lane & route.start[k].mask));
    const N zero = broadcast(n, 0.0), nearest = broadcast(n, gap);
    Light<N> light{{start[0], start[1], start[2]}, {start[3], start[4], start[5]}, start[6], start[7], zero <= zero};
    for (const PreparedEncounter& encounter : route) {
        const CommonFace<N> face{encounter, lane};
        if (encounter.indices_by_lane && encounter.plane_by_lane)
            meet(encounter, IndicesByLane<N, FaceByLane<N>>{{face}}, nearest, light);
        else if (encounter.indices_by_lane) meet(encounter, IndicesByLane<N, CommonFace<N>>{face}, nearest, light);
        else if (encounter.plane_by_lane) meet(encounter, FaceByLane<N>{face}, nearest, light);
        else meet(encounter, face, nearest, light);
    }
    check_end(light);
    for (int k = 0; k < 3; ++k) store(light.point[k], to.point[k]), store(light.direction[k], to.direction[k]);
    store(light.optical_length, to.optical_length);
    store(light.reduced_length, to.reduced_length);
    store(light.followed, to.followed);
}

LaneResults from_lane(const LaneResults& results, std::size_t lane) {
    LaneResults to = results;
    for (int k = 0; k < 3; ++k) to.point[k] += lane, to.direction[k] += lane;
    to.optical_length += lane, to.reduced_length += lane, to.followed += lane;
    return to;
}

// Results of the lanes that do not fill a vector: made in here, for a vector that ends with the last lane.
struct Aside {
    double number[8][hn::MaxLanes(Tag())];
    std::uint8_t followed[hn::MaxLanes(Tag())];
    LaneResults results{
        {number[0], number[1], number[2]}, {number[3], number[4], number[5]}, number[6], number[7], followed};
};

void copy(const LaneResults& from, std::size_t lanes, const LaneResults& to) {
    for (int k = 0; k < 3; ++k) {
        std::copy_n(from.point[k], lanes, to.point[k]);
        std::copy_n(from.direction[k], lanes, to.direction[k]);
    }
    std::copy_n(from.optical_length, lanes, to.optical_length);
    std::copy_n(from.reduced_length, lanes, to.reduced_length);
    std::copy_n(from.followed, lanes, to.followed);
}

void replay_lanes(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
                  const LaneResults& results) {
    const std::size_t one = width(Type<Vector>()), two = width(Type<Pair>());
    PreparedRoute prepared(route, rays, lanes, two, one);
    prepare_indices(prepared);
    // First, because results may be written over what the rays came from.
    Aside aside;
    const std::size_t left = lanes % one;
    if (left > 0) follow<Vector>(prepared, std::max(lanes, one) - one, gap, aside.results);

    std::size_t lane = 0;
    for (; lane + two <= lanes; lane += two) follow<Pair>(prepared, lane, gap, from_lane(results, lane));
    if (lane + one <= lanes) follow<Vector>(prepared, lane, gap, from_lane(results, lane));
    if (left > 0) copy(from_lane(aside.results, lanes < one ? 0 : one - left), left, from_lane(results, lanes - left));
}

const char* target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(replay_lanes);
HWY_EXPORT(target);

}  // namespace

void replay(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
            const LaneResults& results) {
    if (lanes > 0) HWY_DYNAMIC_DISPATCH(replay_lanes)(route, rays, lanes, gap, results);
}

std::string replay_target() { return HWY_DYNAMIC_DISPATCH(target)(); }

std::vector<std::string> replay_targets() {
    std::vector<std::string> names;
    for (const std::int64_t each : hwy::SupportedAndGeneratedTargets()) names.push_back(hwy::TargetName(each));
    return names;
}

void choose_replay_target(const std::string& name) {
    std::string known;
    for (const std::int64_t each : hwy::SupportedAndGeneratedTargets()) {
        if (name == hwy::TargetName(each)) {
            hwy::GetChosenTarget().Update(each);
            return;
        }
        known += std::string(" ") + hwy::TargetName(each);
    }
    throw InvalidArgument("replay target: \"" + name + "\": expected one of" + known);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
