// Reproducible random numbers: counter-based, so a number depends on (seed, counter) alone, never on who asks first.
// Generator: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11), from Random123.
#pragma once

#include <array>
#include <cstdint>

namespace stepdiag {

// What the numbers are for; each purpose is a stream of its own under one seed.
enum class RandomStream : std::uint32_t { reading_noise = 1, error_map = 2, verification = 3 };

// Two independent standard normal numbers for one counter (Box-Muller on the two 64-bit halves of one Philox block).
std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);

// Two independent numbers, uniform in (0, 1).
std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);

}  // namespace stepdiag
