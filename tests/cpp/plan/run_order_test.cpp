#include "stepdiag/plan/run_order.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace {

using namespace stepdiag;

// Two body diagonals of two steps and a scale line, in a volume whose nodes are whole numbers.
Plan plan() {
    return Plan({2.0, 4.0, 6.0}, {Line::parse("ppp"), Line::parse("n0p")}, 2,
                std::vector<StepOrder>{parse_order("XYZ"), parse_order("ZYX")}, {Line::parse("0n0")});
}

// "row: line index, line, run, direction, number: x y z, ..." of each pass.
std::vector<std::string> written(const std::vector<PlannedPass>& passes) {
    std::vector<std::string> lines;
    for (const PlannedPass& pass : passes) {
        std::ostringstream text;
        text << pass.first_row << " of " << pass.setup_row << ": " << pass.line_index << " " << pass.line.name()
             << " run " << pass.run << " " << name(pass.direction);
        for (const PlanPoint& point : pass.points) text << ", " << point.number << ": " << point.commanded.transpose();
        lines.push_back(text.str());
    }
    return lines;
}

}  // namespace

TEST(RunOrder, IsThatOfAListWrittenByHand) {
    EXPECT_EQ(written(planned_passes(plan(), 2, false)),
              (std::vector<std::string>{
                  "0 of 0: 0 ppp run 0 forward, 0: 0 0 0, 1: 1 0 0, 2: 1 2 0, 3: 1 2 3, 4: 2 2 3, 5: 2 4 3, 6: 2 4 6",
                  "7 of 7: 0 ppp run 1 forward, 0: 0 0 0, 1: 0 0 3, 2: 0 2 3, 3: 1 2 3, 4: 1 2 6, 5: 1 4 6, 6: 2 4 6",
                  "14 of 14: 1 n0p run 0 forward, 0: 2 0 0, 1: 1 0 0, 2: 1 0 3, 3: 0 0 3, 4: 0 0 6",
                  "19 of 19: 1 n0p run 1 forward, 0: 2 0 0, 1: 2 0 3, 2: 1 0 3, 3: 1 0 6, 4: 0 0 6",
                  "24 of 24: 2 0n0 run 0 forward, 0: 0 4 0, 1: 0 0 0",
                  "26 of 26: 2 0n0 run 1 forward, 0: 0 4 0, 1: 0 0 0",
              }));
}

TEST(RunOrder, BackwardPassesReadThePointsOfTheirRunDescendingInTheSetUpOfTheForwardOne) {
    EXPECT_EQ(written(planned_passes(plan(), 1, true)),
              (std::vector<std::string>{
                  "0 of 0: 0 ppp run 0 forward, 0: 0 0 0, 1: 1 0 0, 2: 1 2 0, 3: 1 2 3, 4: 2 2 3, 5: 2 4 3, 6: 2 4 6",
                  "7 of 0: 0 ppp run 1 backward, 6: 2 4 6, 5: 1 4 6, 4: 1 2 6, 3: 1 2 3, 2: 0 2 3, 1: 0 0 3, 0: 0 0 0",
                  "14 of 14: 1 n0p run 0 forward, 0: 2 0 0, 1: 1 0 0, 2: 1 0 3, 3: 0 0 3, 4: 0 0 6",
                  "19 of 14: 1 n0p run 1 backward, 4: 0 0 6, 3: 1 0 6, 2: 1 0 3, 1: 2 0 3, 0: 2 0 0",
                  "24 of 24: 2 0n0 run 0 forward, 0: 0 4 0, 1: 0 0 0",
                  "26 of 24: 2 0n0 run 1 backward, 1: 0 0 0, 0: 0 4 0",
              }));
    EXPECT_EQ(planned_passes(plan(), 2, true).back().run, 3);
}

TEST(RunOrder, AxesComeToAPointAsThePassTravels) {
    const auto signs = [](const char* line, Direction direction) {
        std::string text;
        for (const Approach approach : approaches(Line::parse(line), direction))
            text += approach == Approach::positive ? '+' : '-';
        return text;
    };
    EXPECT_EQ(signs("nnp", Direction::forward), "--+");
    EXPECT_EQ(signs("nnp", Direction::backward), "++-");
    EXPECT_EQ(signs("00n", Direction::forward), "++-");
    EXPECT_EQ(signs("00n", Direction::backward), "+++");
    EXPECT_EQ(signs("p0p", Direction::backward), "-+-");
}
