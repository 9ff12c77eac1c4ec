#include "stepdiag/core/random_blocks.hpp"

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "core/random_blocks.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/random_blocks-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

void fill_uniform_lanes(const RandomBlocks& lanes, std::size_t items, double* out) {
    const WordTag words;
    const std::size_t width = hn::Lanes(words);
    const RoundKeys keys(lanes.seed);
    const Words ramp = hn::Iota(words, 0);
    for (std::size_t lane = 0; lane < lanes.lanes; lane += 2 * width) {
        const auto samples = [&](std::size_t first)
                                 HWY_ATTR { return hn::Add(hn::Set(words, lanes.first_sample + first), ramp); };
        const WordPair sample = {samples(lane), samples(lane + width)};
        for (std::size_t item = 0; item < items; ++item) {
            const TwoPairs pair =
                uniform_lanes(keys, lanes.stream, sample, std::uint32_t(lanes.first_item + item), lanes.draw);
            double* const to = out + 2 * item * lanes.lanes + lane;
            store(pair.first, to);
            store(pair.second, to + lanes.lanes);
        }
    }
}

// In two steps, so that the processor has several numbers of each at once in work.
void fill_normal_lanes(const RandomBlocks& lanes, std::size_t items, double* out) {
    fill_uniform_lanes(lanes, items, out);
    for (double* first = out; first < out + 2 * items * lanes.lanes; first += 2 * lanes.lanes)
        for (std::size_t lane = 0; lane < lanes.lanes; lane += 2 * hn::Lanes(Tag())) {
            double* const second = first + lanes.lanes;
            const TwoPairs pair = normal_lanes({load(first + lane), load(second + lane)});
            store(pair.first, first + lane);
            store(pair.second, second + lane);
        }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(fill_uniform_lanes);
HWY_EXPORT(fill_normal_lanes);

}  // namespace

void fill_uniform(const RandomBlocks& lanes, std::size_t items, double* out) {
    HWY_DYNAMIC_DISPATCH(fill_uniform_lanes)(lanes, items, out);
}

void fill_normal(const RandomBlocks& lanes, std::size_t items, double* out) {
    HWY_DYNAMIC_DISPATCH(fill_normal_lanes)(lanes, items, out);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
