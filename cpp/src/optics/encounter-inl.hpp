// What a face does to light on a known way: one text for vectors of lanes (replay.cpp) and for numbers that carry their
// derivative (replay_derivative.cpp).
#if defined(STEPDIAG_ENCOUNTER_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_ENCOUNTER_INL
#undef STEPDIAG_ENCOUNTER_INL
#else
#define STEPDIAG_ENCOUNTER_INL
#endif

#include "core/number.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/replay.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

template <class N>
struct Light {
    N point[3], direction[3];
    N optical_length, reduced_length;
    Truth<N> followed;
};

template <class N>
STEPDIAG_INLINE N dot_add(const N (&a)[3], const N (&b)[3], N c) {
    return mul_add(a[0], b[0], mul_add(a[1], b[1], mul_add(a[2], b[2], c)));
}

template <class N>
STEPDIAG_INLINE Truth<N> within(const std::array<double, 3>& edge, N x, N y) {
    const Type<N> n;
    return mul_add(broadcast(n, edge[0]), x, broadcast(n, edge[1]) * y) <= broadcast(n, edge[2]);
}

// Whether a point of the face's plane, in scene coordinates, is inside the outline.
template <class N, class Face>
STEPDIAG_INLINE Truth<N> inside(const Outline& outline, const Face& face, const N (&point)[3]) {
    const N row_x[3] = {face.rotation(0), face.rotation(1), face.rotation(2)};
    const N row_y[3] = {face.rotation(3), face.rotation(4), face.rotation(5)};
    const N x = dot_add(row_x, point, face.translation(0));
    const N y = dot_add(row_y, point, face.translation(1));
    const Type<N> n;
    if (outline.is_centred_rectangle)
        return both(magnitude(x) <= broadcast(n, outline.half_size[0]),
                    magnitude(y) <= broadcast(n, outline.half_size[1]));
    Truth<N> all = within(outline.edges.front(), x, y);
    for (std::size_t k = 1; k < outline.edges.size(); ++k) all = both(all, within(outline.edges[k], x, y));
    return all;
}

// Propagates light to the face's plane and applies the event. `Met` has event, deflects and outline. `Face` gives the
// numbers as N: rotation(0..8), translation(0..2), index() before the face, its inverse inverse_index(), index_ratio()
// mu = before / after, and 1 - mu^2.
template <class N, class Met, class Face>
STEPDIAG_INLINE void meet(const Met& met, const Face& face, N gap, Light<N>& light) {
    const N normal[3] = {face.rotation(6), face.rotation(7), face.rotation(8)};
    N(&d)[3] = light.direction;
    const N along = mul_add(normal[0], d[0], mul_add(normal[1], d[1], normal[2] * d[2]));  // signed cosine
    const N beyond = dot_add(normal, light.point, face.translation(2));  // distance from the plane along its normal
    const N distance = negative(beyond) / along;
    light.followed = both(light.followed, distance > gap);
    for (int k = 0; k < 3; ++k) light.point[k] = mul_add(distance, d[k], light.point[k]);
    light.optical_length = mul_add(distance, face.index(), light.optical_length);
    light.reduced_length = mul_add(distance, face.inverse_index(), light.reduced_length);
    light.followed = both(light.followed, inside(*met.outline, face, light.point));

    if (met.event == Event::absorbed || (met.event == Event::refracted && !met.deflects)) return;
    // Snell's law: with mu = n1/n2, the squared cosine behind the face is (1 - mu^2) + mu^2 along^2. A negative value
    // means total internal reflection.
    if (met.event == Event::refracted) {
        const N mu = face.index_ratio();
        const N cosine = mu * along;
        const N cosine2_behind = mul_add(cosine, cosine, face.one_less_ratio2());
        light.followed = both(light.followed, broadcast(Type<N>(), 0.0) <= cosine2_behind);
        const N change = with_sign(root(cosine2_behind), along) - cosine;
        for (int k = 0; k < 3; ++k) d[k] = mul_add(change, normal[k], mu * d[k]);
        return;
    }
    if (met.event == Event::totally_reflected) {
        const N cosine = face.index_ratio() * along;
        const N cosine2_behind = mul_add(cosine, cosine, face.one_less_ratio2());
        light.followed = both(light.followed, broadcast(Type<N>(), 0.0) > cosine2_behind);
    }
    const N twice = along + along;
    for (int k = 0; k < 3; ++k) d[k] = sub_mul(twice, normal[k], d[k]);
}

// x - x is 0 for finite x, and NaN for infinite x and NaN.
template <class N>
STEPDIAG_INLINE Truth<N> is_finite(N a) {
    return magnitude(a - a) <= broadcast(Type<N>(), 0.0);
}

template <class N>
STEPDIAG_INLINE void check_end(Light<N>& light) {
    light.followed = both(light.followed, both(is_finite(light.optical_length), is_finite(light.reduced_length)));
    for (int k = 0; k < 3; ++k) {
        light.followed = both(light.followed, is_finite(light.point[k]));
        light.followed = both(light.followed, is_finite(light.direction[k]));
    }
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
