#include "monte_carlo/coverage_intervals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "monte_carlo/moment_tree.hpp"
#include "stepdiag/core/random.hpp"

using namespace stepdiag;

namespace {

OutputBins bins_from(double lower, double width, std::uint32_t count) {
    return {0.0, 1.0, 0.0, 0.0, lower, width, count, 0};
}

// Below the bins, the bins, above.
std::vector<std::uint32_t> counted(const OutputBins& bins, const std::vector<double>& values) {
    std::vector<std::uint32_t> counts(bins.bins + 2);
    for (const double value : values) {
        const double place = std::floor((value - bins.lower) / bins.width) + 1.0;
        ++counts[std::size_t(std::clamp(place, 0.0, double(bins.bins + 1)))];
    }
    return counts;
}

}  // namespace

TEST(CoverageIntervals, AreInterpolatedWithinBins) {
    const OutputBins bins = bins_from(0.0, 1.0, 4);
    const std::vector<std::uint32_t> counts = {0, 10, 20, 50, 20, 0};  // 100 values in 0 to 4
    const CountedValues values(bins, counts.data(), 0.0, 4.0);
    EXPECT_DOUBLE_EQ(values.quantile(0.0), 0.0);
    EXPECT_DOUBLE_EQ(values.quantile(0.05), 0.5);
    EXPECT_DOUBLE_EQ(values.quantile(0.2), 1.5);
    EXPECT_DOUBLE_EQ(values.quantile(1.0), 4.0);
    EXPECT_TRUE(values.symmetric_interval(0.9).isApprox(Eigen::RowVector2d(0.5, 3.75), 1e-15));  // rounding
    EXPECT_EQ(values.shortest_interval(0.5), Eigen::RowVector2d(2.0, 3.0));
}

TEST(CoverageIntervals, EndAtTheLowestAndTheHighestValueWithinTheirBins) {
    const OutputBins bins = bins_from(0.0, 1.0, 4);
    const std::vector<std::uint32_t> counts = {0, 1, 0, 0, 1, 0};
    const CountedValues values(bins, counts.data(), 0.25, 3.5);
    EXPECT_EQ(values.quantile(0.0), 0.25);
    EXPECT_EQ(values.quantile(0.5), 1.0);  // the first value's bin ends there
    EXPECT_EQ(values.quantile(1.0), 3.5);
    const std::vector<std::uint32_t> equal = {0, 0, 7, 0, 0, 0};
    EXPECT_EQ(CountedValues(bins, equal.data(), 1.5, 1.5).symmetric_interval(0.95), Eigen::RowVector2d(1.5, 1.5));
}

TEST(CoverageIntervals, ValuesBeyondTheBinsReachToTheExtremes) {
    const OutputBins bins = bins_from(0.0, 1.0, 2);
    const std::vector<std::uint32_t> counts = {10, 40, 40, 10};
    const CountedValues values(bins, counts.data(), -5.0, 12.0);
    EXPECT_DOUBLE_EQ(values.quantile(0.05), -2.5);
    EXPECT_DOUBLE_EQ(values.quantile(0.1), 0.0);
    EXPECT_DOUBLE_EQ(values.quantile(0.95), 7.0);
}

TEST(CoverageIntervals, AreThoseOfSortedValuesToTheWidthOfABin) {
    // Skew: exponential. Fine bins, so that many are empty.
    constexpr int n = 3000;
    std::vector<double> values;
    for (int i = 0; i < n; ++i)
        values.push_back(-std::log(uniform_pair(4, RandomStream::verification, std::uint64_t(i))[0]));
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (const double width : {0.1, 0.01, 0.0007}) {
        const OutputBins bins = bins_from(-0.01, width, std::uint32_t(6.0 / width));  // some values are above
        const auto counts = counted(bins, values);
        const CountedValues found(bins, counts.data(), sorted.front(), sorted.back());
        for (const double p : {0.3, 0.95}) {
            const auto at = [&](double share) { return sorted[std::size_t(std::lround(share * n))]; };
            const Eigen::RowVector2d symmetric = found.symmetric_interval(p);
            // A gap between two values may lie beside the quantile: 0.02 at the 97.5th of 3,000.
            EXPECT_NEAR(symmetric[0], at(0.5 * (1.0 - p)), width + 0.001);
            EXPECT_NEAR(symmetric[1], at(0.5 * (1.0 + p)), width + 0.03);
            double shortest = 1e300;
            const std::size_t inside = std::size_t(std::lround(p * n));
            for (std::size_t k = 0; k + inside < sorted.size(); ++k)
                shortest = std::min(shortest, sorted[k + inside] - sorted[k]);
            const Eigen::RowVector2d interval = found.shortest_interval(p);
            EXPECT_NEAR(interval[1] - interval[0], shortest, 2.0 * width + 0.01);
            EXPECT_LE(interval[1] - interval[0], symmetric[1] - symmetric[0]);
        }
    }
}

TEST(MomentTree, HasTheSameNodesForAnyOrderOfLeaves) {
    const auto leaf = [](std::uint64_t number) {
        const double x = 1.0 / double(number + 3);  // sums of them round
        return MomentTree::Node{0, {1, 0, Eigen::VectorXd::Constant(1, x), Eigen::VectorXd::Constant(1, x * x), {}}};
    };
    std::vector<std::uint64_t> order = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    MomentTree ascending;
    for (const std::uint64_t number : order) ascending.add(number, leaf(number));
    EXPECT_EQ(ascending.nodes().size(), 3u);  // 8 + 2 + 1
    for (int turn = 0; turn < 20; ++turn) {
        for (std::size_t i = 0; i < order.size(); ++i) std::swap(order[i], order[(i * 5 + std::size_t(turn)) % 11]);
        MomentTree tree, other;
        for (std::size_t i = 0; i < order.size(); ++i) (i % 3 ? tree : other).add(order[i], leaf(order[i]));
        tree.add(other);
        ASSERT_EQ(tree.nodes().size(), 3u);
        EXPECT_EQ(tree.total(1).first[0], ascending.total(1).first[0]);
        EXPECT_EQ(tree.total(1).second[0], ascending.total(1).second[0]);
    }
    EXPECT_EQ(ascending.leaves(), (std::vector<LeafRange>{{0, 11}}));
}
