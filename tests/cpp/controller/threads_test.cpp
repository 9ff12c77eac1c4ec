// One compensator, many threads: every answer has the bits that one thread gets. Under -fsanitize=thread (preset tsan)
// this also shows that nothing is written behind the const.
#include <gtest/gtest.h>

#include <cstring>
#include <thread>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/error_map.hpp"

namespace {

using stepdiag::Compensator;

constexpr int positions = 2000;

Compensator make_compensator() {
    stepdiag::ParameterTable table = stepdiag::make_random_error_map({800.0, 600.0, 500.0}, {}).table();
    table.header = {{"chain", "[w X' b Y Z t]"}, {"volume_mm", "800 600 500"}, {"tool_mm", "5 -3 80"}};
    return Compensator(table, "random", "[w X' b Y Z t]");
}

// Every function of the compensator along a line that leaves the volume on both sides.
std::vector<double> answers(const Compensator& c) {
    std::vector<double> all;
    const auto add = [&](const std::array<double, 3>& v) { all.insert(all.end(), v.begin(), v.end()); };
    for (int i = 0; i < positions; ++i) {
        const double t = 1.2 * i / positions - 0.1;
        const std::array<double, 3> p = {800.0 * t, 600.0 * (1.0 - t), 500.0 * t * t}, tool = {0.0, 10.0 * t, 90.0};
        const auto error = c.error(p, tool);
        const auto command = c.command(p, tool), forward = c.forward(p, c.tool());
        add(error.position), add(error.orientation), add(command.position), add(forward.position);
        all.push_back(error.status | command.status << 4 | forward.status << 8);
    }
    all.push_back(double(c.fingerprint() % 1'000'003));
    all.push_back(double(c.uncompensated().size()));
    return all;
}

}  // namespace

TEST(CompensatorThreads, GiveTheBitsOfOneThread) {
    const Compensator compensator = make_compensator();
    const std::vector<double> expected = answers(compensator);
    std::vector<std::vector<double>> found(16);
    std::vector<std::thread> threads;
    for (auto& one : found) threads.emplace_back([&] { one = answers(compensator); });
    for (std::thread& thread : threads) thread.join();
    for (const auto& one : found) {
        ASSERT_EQ(one.size(), expected.size());
        EXPECT_EQ(std::memcmp(one.data(), expected.data(), expected.size() * sizeof(double)), 0);
    }
}

TEST(CompensatorThreads, MayLoadAtTheSameTime) {
    const std::vector<double> expected = answers(make_compensator());
    std::vector<std::thread> threads;
    std::vector<int> same(8, 0);
    for (int& one : same) threads.emplace_back([&] { one = answers(make_compensator()) == expected; });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(same, std::vector<int>(8, 1));
}
