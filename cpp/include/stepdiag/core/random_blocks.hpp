// The random numbers of core/random.hpp for many counters at once. Each SIMD lane computes one sample.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stepdiag/core/random.hpp"

namespace stepdiag {

// Addresses of many blocks RandomBlock{sample, item, draw}. The samples are first_sample, ..., first_sample + lanes -
// 1, the items first_item, first_item + 1, ... `lanes` must be a multiple of lane_group. Both numbers of a pair are
// written: out[(2 * (item - first_item) + k) * lanes + lane] with k = 0, 1 and lane = sample - first_sample.
struct RandomBlocks {
    std::uint64_t seed;
    RandomStream stream;
    std::uint64_t first_sample;
    std::size_t lanes;
    std::uint32_t first_item = 0;
    std::uint16_t draw = 0;
};
inline constexpr std::size_t lane_group = 16;

// Same bits as uniform_pair. `out` has room for 2 * items * lanes numbers.
void fill_uniform(const RandomBlocks& lanes, std::size_t items, double* out);
// Same numbers as normal_pair to a few units in the last place. Bits are reproducible for one instruction set
// (core/instruction_set.hpp).
void fill_normal(const RandomBlocks& lanes, std::size_t items, double* out);

}  // namespace stepdiag
