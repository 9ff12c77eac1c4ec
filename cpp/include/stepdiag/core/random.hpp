// Reproducible random numbers: counter-based, so a number depends on (seed, counter) alone, never on who asks first.
// Generator: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11), from Random123.
#pragma once

#include <array>
#include <cstdint>

namespace stepdiag {

// What the numbers are for; each purpose is a stream of its own under one seed.
enum class RandomStream : std::uint32_t {
    reading_noise = 1,
    error_map = 2,
    verification = 3,
    camera_shot_noise = 16,
    camera_read_noise = 17,
    position_device = 18,
    virtual_calibration = 32,
    monte_carlo = 33,  // inputs of a model given by the user
};

// One block of random bits: its counter, and where one counter stands for many numbers (an image) the number of the
// item and of the draw for it.
struct RandomBlock {
    std::uint64_t counter = 0;
    std::uint32_t item = 0;
    std::uint16_t draw = 0;
};

// Two independent standard normal numbers for one counter (Box-Muller on the two 64-bit halves of one Philox block).
std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);
std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block);

// Two independent numbers, uniform in (0, 1).
std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);
std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block);

// A Poisson number of this mean (0 to 1e15), exactly distributed: by inversion below 10, by the transformed rejection
// PTRS from there on (W. Hoermann, Insurance: Mathematics and Economics 12 (1993) 39), draw by draw.
double poisson(double mean, std::uint64_t seed, RandomStream stream, std::uint64_t counter, std::uint32_t item);

}  // namespace stepdiag
