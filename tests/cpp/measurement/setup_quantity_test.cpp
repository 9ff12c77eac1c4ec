#include "stepdiag/measurement/setup_quantity.hpp"

#include <gtest/gtest.h>

#include <set>

namespace {

using namespace stepdiag;

TEST(SetupQuantity, ColumnsFollowTheTableWithBeamsLast) {
    EXPECT_EQ(setup::reflector, 0);
    EXPECT_EQ(setup::laser, 2);
    EXPECT_EQ(setup::distance_constant, 4);
    EXPECT_EQ(setup::psd_zero, 5);
    EXPECT_EQ(setup::lateral, 7);
    EXPECT_EQ(setup::roll, 9);
    EXPECT_EQ(setup::gain, 10);
    EXPECT_EQ(setup::drift, 11);
    EXPECT_EQ(setup::scale_length, 12);
    EXPECT_EQ(setup::scale_factor, 13);
    EXPECT_EQ(setup::beam_constants, 14);
    EXPECT_EQ(setup::size(0), 14);
    EXPECT_EQ(setup::size(4), 18);
}

TEST(SetupQuantity, EveryColumnIsAComponentOfItsQuantity) {
    constexpr int beams = 5;
    std::set<int> columns;
    for (int q = 0; q < setup_quantity_count; ++q) {
        const auto [first, count] = setup::columns(SetupQuantity(q), beams);
        for (int k = 0; k < count; ++k) {
            EXPECT_TRUE(columns.insert(first + k).second);
            EXPECT_EQ(setup::component(first + k).quantity, SetupQuantity(q));
            EXPECT_EQ(setup::component(first + k).number, k);
        }
    }
    EXPECT_EQ(int(columns.size()), setup::size(beams));
    EXPECT_EQ(*columns.rbegin(), setup::size(beams) - 1);
}

}  // namespace
