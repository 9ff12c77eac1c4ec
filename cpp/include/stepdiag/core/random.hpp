// Reproducible random numbers. The generator is counter-based: a number depends on seed, stream and counter only, not
// on the order of the calls. Generator: Philox4x32-10 of Random123 (Salmon et al., "Parallel random numbers: as easy as
// 1, 2, 3", SC11).
#pragma once

#include <array>
#include <cstdint>

namespace stepdiag {

// The purpose of the numbers. Each purpose has its own stream, independent of the others for the same seed.
enum class RandomStream : std::uint32_t {
    reading_noise = 1,
    error_map = 2,
    verification = 3,
    variance_components = 4,
    null_vectors = 5,
    camera_shot_noise = 16,
    camera_read_noise = 17,
    position_device = 18,
    virtual_calibration = 32,
    monte_carlo = 33,  // inputs of a user's model (FunctionModel)
};

// Address of one block of random bits. `item` and `draw` number the blocks of one counter, where a counter needs many
// numbers (for example, the pixels of an image).
struct RandomBlock {
    std::uint64_t counter = 0;
    std::uint32_t item = 0;
    std::uint16_t draw = 0;
};

// Two independent standard normal numbers. Box-Muller transform of the two 64-bit halves of one Philox block.
std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);
std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block);

// Two independent numbers, uniform in the open interval (0, 1).
std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter);
std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block);

// An exactly distributed Poisson number with this mean (0 to 1e15). Inversion for means below 10, transformed rejection
// (PTRS; W. Hoermann, Insurance: Mathematics and Economics 12 (1993) 39) for larger means. The function numbers its
// draws itself.
double poisson(double mean, std::uint64_t seed, RandomStream stream, std::uint64_t counter, std::uint32_t item);

}  // namespace stepdiag
