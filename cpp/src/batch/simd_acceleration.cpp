#include "batch/simd_acceleration.hpp"

#include <utility>

#include "core/simd_targets.hpp"
#include "stepdiag/core/random_blocks.hpp"
#define HWY_TARGET_INCLUDE "batch/simd_acceleration.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// Numbers minus `one` times their difference to those of the last step, minus `two` times that to the step before.
struct Combination {
    Pair one, two;
    MaskPair is_used;

    STEPDIAG_INLINE Pair of(Pair number, Pair last, Pair before) const {
        const Pair combined = sub_mul(two, number - before, sub_mul(one, number - last, number));
        return select(is_used, combined, number);
    }
};

// The smallest |f - one a - two b|, where f is a step, a and b its differences to the two before.
STEPDIAG_INLINE Combination find_combination(const double* ready, std::size_t end, const double* dx, const double* last,
                                             const double* before) {
    Pair aa = all(0.0), ab = aa, bb = aa, af = aa, bf = aa;
    for (std::size_t at = 0; at < end; at += lane_group) {
        const Pair f = load(dx + at), a = f - load(last + at), b = f - load(before + at);
        aa = mul_add(a, a, aa), ab = mul_add(a, b, ab), bb = mul_add(b, b, bb);
        af = mul_add(a, f, af), bf = mul_add(b, f, bf);
    }
    const Pair determinant = aa * bb - ab * ab;
    const Pair one = (bb * af - ab * bf) / determinant, two = (aa * bf - ab * af) / determinant;
    // Larger factors would say that steps do not shrink, differences along one line that these do not show a plane.
    const MaskPair small = both(magnitude(one) <= all(1.0), magnitude(two) <= all(1.0));
    const MaskPair plane = determinant > all(1e-6) * aa * bb;
    return {one, two, both(load(ready) > all(0.0), both(small, plane))};
}

void accelerate(const double* ready, std::size_t unknowns, std::size_t residuals, const double* x, double* dx,
                double* s, const SimdAcceleration::Past& last, SimdAcceleration::Past& before) {
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const std::size_t end = lane_group * unknowns, end_s = lane_group * residuals;
        const Combination combination =
            find_combination(ready + lane, end, dx + lane, last.dx.data() + lane, before.dx.data() + lane);
        for (std::size_t at = lane; at < end; at += lane_group) {
            const Pair from = load(x + at), step = load(dx + at), to = from + step;
            const Pair combined = combination.of(to, load(last.x.data() + at), load(before.x.data() + at)) - from;
            store(select(combination.is_used, combined, step), dx + at);
            store(to, before.x.data() + at);
            store(step, before.dx.data() + at);
        }
        for (std::size_t at = lane; at < end_s; at += lane_group) {
            const Pair residual = load(s + at);
            store(combination.of(residual, load(last.s.data() + at), load(before.s.data() + at)), s + at);
            store(residual, before.s.data() + at);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(accelerate);

AlignedNumbers lanes_of(std::size_t count) { return AlignedNumbers(std::ptrdiff_t(count * lane_group)); }

}  // namespace

SimdAcceleration::SimdAcceleration(std::size_t unknowns, std::size_t residuals)
    : unknowns_(unknowns),
      residuals_(residuals),
      past_{Past{lanes_of(unknowns), lanes_of(unknowns), lanes_of(residuals)},
            Past{lanes_of(unknowns), lanes_of(unknowns), lanes_of(residuals)}} {}

void SimdAcceleration::apply(const double* ready, const double* x, double* dx, double* s) {
    HWY_DYNAMIC_DISPATCH(accelerate)(ready, unknowns_, residuals_, x, dx, s, past_[0], past_[1]);
    std::swap(past_[0], past_[1]);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
