// The numbers of core/random.hpp for many counters at once: one sample a lane, from vectors of eight and more.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stepdiag/core/random.hpp"

namespace stepdiag {

// Blocks of random bits as RandomBlock{sample, item, draw}: lanes are the samples first_sample, first_sample + 1, ...,
// items first_item, first_item + 1, ...; `lanes` is a multiple of lane_group. Both numbers of a pair are given:
// out[(2 * (item - first_item) + k) * lanes + lane], k = 0, 1.
struct RandomBlocks {
    std::uint64_t seed;
    RandomStream stream;
    std::uint64_t first_sample;
    std::size_t lanes;
    std::uint32_t first_item = 0;
    std::uint16_t draw = 0;
};
inline constexpr std::size_t lane_group = 16;

// The same bits as uniform_pair.
void fill_uniform(const RandomBlocks& lanes, std::size_t items, double* out);
// normal_pair to a few units in the last place: the same bits for one instruction set (instruction_set).
void fill_normal(const RandomBlocks& lanes, std::size_t items, double* out);

}  // namespace stepdiag
