#include "stepdiag/core/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>

namespace {

using Block = std::array<std::uint32_t, 4>;

// Philox4x32-10 written from the paper (Salmon et al., SC11, section 3.4), independent of the Random123 headers.
Block philox(Block c, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = 0xD2511F53ull * c[0];
        const std::uint64_t b = 0xCD9E8D57ull * c[2];
        c = {std::uint32_t(b >> 32) ^ c[1] ^ key[0], std::uint32_t(b), std::uint32_t(a >> 32) ^ c[3] ^ key[1],
             std::uint32_t(a)};
        key[0] += 0x9E3779B9u;
        key[1] += 0xBB67AE85u;
    }
    return c;
}

double to_unit(std::uint32_t low, std::uint32_t high) {
    const std::uint64_t word = (std::uint64_t(high) << 32) | low;
    return std::ldexp(double(word >> 11) + 0.5, -53);
}

}  // namespace

TEST(Random, ReferencePhiloxGivesTheKnownAnswersOfRandom123) {  // kat_vectors, philox4x32 10
    EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    EXPECT_EQ(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}), (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
    EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
              (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, UniformPairIsOnePhiloxBlockOfSeedStreamAndCounter) {
    for (const std::uint64_t seed : {0ull, 1ull, 0x123456789abcdefull, ~0ull})
        for (const std::uint64_t counter : {0ull, 1ull, (604ull << 16) | 2, ~0ull})
            for (const auto stream : {stepdiag::RandomStream::reading_noise, stepdiag::RandomStream::error_map}) {
                const Block bits =
                    philox({std::uint32_t(counter), std::uint32_t(counter >> 32), 0, std::uint32_t(stream)},
                           {std::uint32_t(seed), std::uint32_t(seed >> 32)});
                const auto pair = stepdiag::uniform_pair(seed, stream, counter);
                EXPECT_EQ(pair[0], to_unit(bits[0], bits[1]));  // the same bits: integers until one exact scaling
                EXPECT_EQ(pair[1], to_unit(bits[2], bits[3]));
            }
}

TEST(Random, NormalPairHasTheMomentsOfAStandardNormal) {
    constexpr int pairs = 200'000;
    double mean[2] = {}, square[2] = {}, cube[2] = {}, fourth[2] = {}, product = 0.0, previous = 0.0, serial = 0.0;
    for (int i = 0; i < pairs; ++i) {
        const auto x = stepdiag::normal_pair(42, stepdiag::RandomStream::reading_noise, i);
        for (int j = 0; j < 2; ++j) {
            ASSERT_TRUE(std::isfinite(x[j]));
            mean[j] += x[j] / pairs;
            square[j] += x[j] * x[j] / pairs;
            cube[j] += x[j] * x[j] * x[j] / pairs;
            fourth[j] += x[j] * x[j] * x[j] * x[j] / pairs;
        }
        product += x[0] * x[1] / pairs;
        serial += x[0] * previous / pairs;
        previous = x[0];
    }
    const double sigma = 1.0 / std::sqrt(pairs);  // every limit is five standard deviations of the sample moment
    for (int j = 0; j < 2; ++j) {
        EXPECT_NEAR(mean[j], 0.0, 5.0 * sigma);
        EXPECT_NEAR(square[j], 1.0, 5.0 * std::sqrt(2.0) * sigma);
        EXPECT_NEAR(cube[j], 0.0, 5.0 * std::sqrt(15.0) * sigma);
        EXPECT_NEAR(fourth[j], 3.0, 5.0 * std::sqrt(96.0) * sigma);
    }
    EXPECT_NEAR(product, 0.0, 5.0 * sigma);
    EXPECT_NEAR(serial, 0.0, 5.0 * sigma);
}

TEST(Random, StreamsAndSeedsAreApart) {
    const auto noise = stepdiag::uniform_pair(1, stepdiag::RandomStream::reading_noise, 5);
    EXPECT_EQ(noise, stepdiag::uniform_pair(1, stepdiag::RandomStream::reading_noise, 5));
    EXPECT_NE(noise, stepdiag::uniform_pair(1, stepdiag::RandomStream::error_map, 5));
    EXPECT_NE(noise, stepdiag::uniform_pair(2, stepdiag::RandomStream::reading_noise, 5));
}

TEST(Random, ItemsAndDrawsOfOneCounterAreApart) {
    using stepdiag::RandomBlock;
    const auto stream = stepdiag::RandomStream::camera_read_noise;
    const auto first = stepdiag::uniform_pair(1, stream, RandomBlock{7, 0, 0});
    EXPECT_EQ(first, stepdiag::uniform_pair(1, stream, 7));
    EXPECT_NE(first, stepdiag::uniform_pair(1, stream, RandomBlock{7, 1, 0}));
    EXPECT_NE(first, stepdiag::uniform_pair(1, stream, RandomBlock{7, 0, 1}));
    EXPECT_NE(stepdiag::uniform_pair(1, stream, RandomBlock{7, 1, 0}),
              stepdiag::uniform_pair(1, stream, RandomBlock{7, 0, 1}));
}

// Pearson's statistic over all values that are expected ten times or more, the rest in one class at each end.
TEST(Random, PoissonNumbersHaveTheirDistribution) {
    constexpr int count = 100'000;
    for (const double mean : {0.01, 0.7, 3.0, 9.999, 10.0, 10.7, 55.0, 1234.5}) {
        std::map<long, double> found;
        for (int i = 0; i < count; ++i)
            found[long(stepdiag::poisson(mean, 11, stepdiag::RandomStream::camera_shot_noise, 3, i))] += 1.0;
        double statistic = 0.0, expected_below = 0.0, found_below = 0.0, expected_sum = 0.0, found_sum = 0.0;
        int classes = 0;
        const auto close_class = [&](double expected, double seen) {
            statistic += (seen - expected) * (seen - expected) / expected;
            ++classes;
        };
        for (long k = 0; k <= long(mean + 20.0 * std::sqrt(mean) + 20.0); ++k) {
            expected_below += count * std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
            found_below += found[k];
            if (expected_below < 10.0) continue;
            close_class(expected_below, found_below);
            expected_sum += expected_below, found_sum += found_below;
            expected_below = found_below = 0.0;
        }
        if (count - expected_sum > 0.5) close_class(count - expected_sum, count - found_sum);
        // chi-square of (classes - 1) degrees of freedom: mean and five standard deviations
        EXPECT_LT(statistic, classes - 1 + 5.0 * std::sqrt(2.0 * classes)) << "mean " << mean;
    }
}

TEST(Random, LargePoissonNumbersHaveTheirMoments) {
    constexpr int count = 20'000;
    const double sigma = 1.0 / std::sqrt(count);
    for (const double mean : {1e6, 1e12}) {
        double first = 0.0, second = 0.0;
        for (int i = 0; i < count; ++i) {
            const double x =
                (stepdiag::poisson(mean, 5, stepdiag::RandomStream::camera_shot_noise, i, 0) - mean) / std::sqrt(mean);
            first += x / count;
            second += x * x / count;
        }
        EXPECT_NEAR(first, 0.0, 5.0 * sigma);  // five standard deviations of the sample moment
        EXPECT_NEAR(second, 1.0, 5.0 * std::sqrt(2.0) * sigma);
    }
    EXPECT_EQ(stepdiag::poisson(0.0, 5, stepdiag::RandomStream::camera_shot_noise, 0, 0), 0.0);
}
