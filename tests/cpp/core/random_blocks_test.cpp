#include "stepdiag/core/random_blocks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "stepdiag/core/instruction_set.hpp"

namespace stepdiag {
namespace {

constexpr RandomStream stream = RandomStream::virtual_calibration;

class ForEveryInstructionSet : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override { choose_instruction_set(GetParam()); }
    void TearDown() override { choose_instruction_set(best_); }
    const std::string best_ = instruction_set();
};
INSTANTIATE_TEST_SUITE_P(RandomBlocks, ForEveryInstructionSet, testing::ValuesIn(instruction_sets()),
                         [](const auto& each) { return each.param; });

TEST_P(ForEveryInstructionSet, GivesTheBitsOfUniformPair) {
    // Across the carry of the 32-bit words of sample and seed.
    for (const std::uint64_t first : {std::uint64_t(0), (std::uint64_t(1) << 32) - 16, std::uint64_t(0) - 48}) {
        const RandomBlocks lanes{0x123456789abcdef0, stream, first, 48, 0xfffffffe, 7};
        std::vector<double> out(2 * 3 * lanes.lanes);
        fill_uniform(lanes, 3, out.data());
        for (std::uint32_t item = 0; item < 3; ++item)
            for (std::size_t lane = 0; lane < lanes.lanes; ++lane) {
                const auto expected =
                    uniform_pair(lanes.seed, stream, RandomBlock{first + lane, lanes.first_item + item, lanes.draw});
                for (std::size_t k = 0; k < 2; ++k)
                    EXPECT_EQ(out[(2 * item + k) * lanes.lanes + lane], expected[k])
                        << first << " " << item << " " << lane;
            }
    }
}

TEST_P(ForEveryInstructionSet, GivesNormalPairToRounding) {
    const RandomBlocks lanes{5, stream, 1'000'000, 2000, 3};
    constexpr std::size_t items = 250;
    std::vector<double> out(2 * items * lanes.lanes);
    fill_normal(lanes, items, out.data());
    double worst = 0.0;
    for (std::uint32_t item = 0; item < items; ++item)
        for (std::size_t lane = 0; lane < lanes.lanes; ++lane) {
            const auto expected =
                normal_pair(lanes.seed, stream, RandomBlock{lanes.first_sample + lane, lanes.first_item + item});
            const double radius = std::hypot(expected[0], expected[1]);
            for (std::size_t k = 0; k < 2; ++k)
                worst = std::max(worst, std::abs(out[(2 * item + k) * lanes.lanes + lane] - expected[k]) / radius);
        }
    // normal_pair rounds its angle, of up to 2 pi, by 4.4e-16 and once more by its factor 2 pi; lanes do not.
    EXPECT_LT(worst, 1.2e-15);
}

TEST_P(ForEveryInstructionSet, ALaneDependsOnItsSampleAlone) {
    const RandomBlocks many{5, stream, 64, 256, 11, 2}, few{5, stream, 96, 16, 12, 2};
    std::vector<double> all(2 * 3 * many.lanes), some(2 * few.lanes);
    fill_normal(many, 3, all.data());
    fill_normal(few, 1, some.data());
    for (std::size_t k = 0; k < 2; ++k)
        for (std::size_t lane = 0; lane < few.lanes; ++lane)
            EXPECT_EQ(some[k * few.lanes + lane], all[(2 * 1 + k) * many.lanes + 32 + lane]);
}

}  // namespace
}  // namespace stepdiag
