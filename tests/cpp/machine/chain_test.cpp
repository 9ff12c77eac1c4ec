#include "stepdiag/machine/chain.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/refuses.hpp"

using stepdiag::Axis;
using stepdiag::Chain;

TEST(Chain, AllTwentyFourChainsAreReadBackFromTheirNames) {
    std::set<std::string> names;
    std::string order = "XYZ";
    do {
        for (int before_bed = 0; before_bed <= 3; ++before_bed) {
            std::string text = "[w";
            for (int i = 0; i < 3; ++i) {
                if (i == before_bed) text += " b";
                text += std::string(" ") + order[i] + (i < before_bed ? "'" : "");
            }
            text += before_bed == 3 ? " b t]" : " t]";
            const Chain chain = Chain::parse(text);
            EXPECT_EQ(chain.name(), text);
            EXPECT_EQ(Chain::parse(chain.name()), chain);
            for (int i = 0; i < 3; ++i) {
                EXPECT_EQ(stepdiag::letter(chain.order()[i]), order[i]);
                EXPECT_EQ(chain.carries_workpiece(chain.order()[i]), i < before_bed) << text;
                for (int j = 0; j < 3; ++j)
                    EXPECT_EQ(chain.is_after(chain.order()[i], chain.order()[j]), i > j) << text;
            }
            names.insert(chain.name());
        }
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_EQ(names.size(), 24u);
}

TEST(Chain, BlanksDoNotMatter) { EXPECT_EQ(Chain::parse("  [ w  X' b Y   Z t ] ").name(), "[w X' b Y Z t]"); }

TEST(Chain, WhereNoBlankCanStandNoneIsNeeded) {
    EXPECT_EQ(Chain::parse("wX'bYZt"), Chain::parse("[w X' b Y Z t]"));
    EXPECT_EQ(Chain::parse("wY'X'Z'bt"), Chain::parse("[w Y' X' Z' b t]"));
}

TEST(Chain, WhatIsNoChainIsRefusedByName) {
    for (const char* text : {"",
                             "[]",
                             "[",
                             "w X' b Y Z t",
                             "[w X' b Y Z t",
                             "[w X b Y Z t]",
                             "[w X' b Y' Z t]",
                             "[w X' Y Z t]",
                             "[w X' b Y t]",
                             "[w X' b Y Y t]",
                             "[w X' b Y Z A t]",
                             "[t X' b Y Z w]",
                             "[X' b Y Z t]",
                             "[w b b X Y t]",
                             "[w X'' b Y Z t]",
                             "[w x' b Y Z t]",
                             "[wX'bYZt]",
                             "wX'bYZ",
                             "wXbYZt",
                             "'wX'bYZt",
                             "wX''bYZt",
                             "w",
                             "[w X' b Y Z t] t",
                             "[w b X Y Q t]",
                             "[w ' b Y Z t]"})
        expect_refused([&] { Chain::parse(text); }, "chain \"" + std::string(text) + "\"");
}
