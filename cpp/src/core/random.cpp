#include "stepdiag/core/random.hpp"

#include <Random123/philox.h>

#include <cmath>

#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

// ln k!. Stirling's series for k >= 10; its first neglected term is below 1e-13 there.
double log_factorial(double k) {
    static constexpr double factorial[] = {1, 1, 2, 6, 24, 120, 720, 5040, 40320, 362880};
    if (k < 10.0) return std::log(factorial[int(k)]);
    const double r = 1.0 / (k * k);
    return (k + 0.5) * std::log(k) - k + 0.5 * std::log(2.0 * pi) +
           (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r * (1.0 / 1680.0 - r / 1188.0)))) / k;
}

// The smallest k whose cumulative probability is above u.
double poisson_by_inversion(double mean, double u) {
    constexpr int farthest = 100;  // never reached: for means below 10 its probability is 1e-60
    double probability = std::exp(-mean), cumulative = probability;
    int k = 0;
    while (u >= cumulative && k < farthest) {
        probability *= mean / ++k;
        cumulative += probability;
    }
    return k;
}

}  // namespace

std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block) {
    const r123::Philox4x32::key_type key = {{std::uint32_t(seed), std::uint32_t(seed >> 32)}};
    const r123::Philox4x32::ctr_type counter = {{std::uint32_t(block.counter), std::uint32_t(block.counter >> 32),
                                                 block.item,
                                                 std::uint32_t(stream) | (std::uint32_t(block.draw) << 16)}};
    const auto bits = r123::Philox4x32{}(counter, key);
    const auto to_unit = [](std::uint32_t low, std::uint32_t high) {
        const std::uint64_t word = (std::uint64_t(high) << 32) | low;
        return (double(word >> 11) + 0.5) * 0x1p-53;  // neither 0 nor 1, so that logarithms are finite
    };
    return {to_unit(bits[0], bits[1]), to_unit(bits[2], bits[3])};
}

std::array<double, 2> uniform_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter) {
    return uniform_pair(seed, stream, RandomBlock{counter});
}

std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, const RandomBlock& block) {
    const auto [u, v] = uniform_pair(seed, stream, block);
    const double radius = std::sqrt(-2.0 * std::log(u));
    return {radius * std::cos(2.0 * pi * v), radius * std::sin(2.0 * pi * v)};
}

std::array<double, 2> normal_pair(std::uint64_t seed, RandomStream stream, std::uint64_t counter) {
    return normal_pair(seed, stream, RandomBlock{counter});
}

double poisson(double mean, std::uint64_t seed, RandomStream stream, std::uint64_t counter, std::uint32_t item) {
    if (!(mean > 0.0)) return 0.0;
    if (mean < 10.0) return poisson_by_inversion(mean, uniform_pair(seed, stream, RandomBlock{counter, item})[0]);

    const double b = 0.931 + 2.53 * std::sqrt(mean);  // constants of Hoermann's paper
    const double a = -0.059 + 0.02483 * b;
    const double log_inverse_alpha = std::log(1.1239 + 1.1328 / (b - 3.4));
    const double v_sure = 0.9277 - 3.6224 / (b - 2.0);
    for (std::uint16_t draw = 0;; ++draw) {  // each draw is accepted with a probability of at least 0.7
        const auto [first, v] = uniform_pair(seed, stream, RandomBlock{counter, item, draw});
        const double u = first - 0.5;
        const double us = 0.5 - std::abs(u);
        const double k = std::floor((2.0 * a / us + b) * u + mean + 0.43);
        if (us >= 0.07 && v <= v_sure) return k;
        if (k < 0.0 || (us < 0.013 && v > us)) continue;
        if (std::log(v) + log_inverse_alpha - std::log(a / (us * us) + b) <=
            k * std::log(mean) - mean - log_factorial(k))
            return k;
    }
}

}  // namespace stepdiag
