#include "stepdiag/core/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

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
