#include "stepdiag/core/random.hpp"

#include <Random123/philox.h>

#include <cmath>

#include "stepdiag/core/units.hpp"

namespace stepdiag {

std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter) {
    const r123::Philox4x32::key_type key = {{std::uint32_t(seed), std::uint32_t(seed >> 32)}};
    const r123::Philox4x32::ctr_type block = {
        {std::uint32_t(counter), std::uint32_t(counter >> 32), 0, std::uint32_t(stream)}};
    const auto bits = r123::Philox4x32{}(block, key);
    const auto to_unit = [](std::uint32_t low, std::uint32_t high) {
        const std::uint64_t word = (std::uint64_t(high) << 32) | low;
        return (double(word >> 11) + 0.5) * 0x1p-53;  // never 0 nor 1, so a logarithm is always finite
    };
    return {to_unit(bits[0], bits[1]), to_unit(bits[2], bits[3])};
}

std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter) {
    const auto [u, v] = uniform_pair(seed, stream, counter);
    const double radius = std::sqrt(-2.0 * std::log(u));
    return {radius * std::cos(2.0 * pi * v), radius * std::sin(2.0 * pi * v)};
}

}  // namespace stepdiag
