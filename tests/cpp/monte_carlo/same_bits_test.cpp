// Whoever computes which leaf, in whatever order: the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/monte_carlo/adaptive_procedure.hpp"
#include "stepdiag/monte_carlo/function_model.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"
#include "support/refuses.hpp"

using namespace stepdiag;

namespace {

using Values = FunctionModel::Values;

// Also loses samples now and then.
FunctionModel curved(std::uint64_t seed = 1, double shift = 0.0) {
    return FunctionModel(
        [shift](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) {
            y.row(0) = x.row(0) + 2.0 * x.row(1);
            y.row(1) = (x.row(0) + shift).square();
            for (Eigen::Index s = 0; s < x.cols(); ++s)
                if (x(0, s) > 3.0) y.col(s).setConstant(std::numeric_limits<double>::quiet_NaN());
        },
        {{DistributionKind::normal, 0.0, 1.0}, {DistributionKind::rectangular, 0.0, 1.0}},
        {{"sum", 1.0, "mm"}, {"square", 2.0, "mm"}}, seed);
}

const StatisticsOptions options{0.95, 2, true, {1}, {{0, 1}}};
constexpr std::uint64_t leaves = 23;

std::string bytes_of(const PartialStatistics& part) { return part.to_bytes(); }

// All leaves, in pieces computed apart, sent as bytes and merged in an order of their own.
std::string in_pieces(const SampleModel& model, const Bins& bins, std::uint64_t piece, int threads, unsigned shuffle) {
    std::vector<std::string> parts;
    for (std::uint64_t first = 0; first < leaves; first += piece)
        parts.push_back(run_leaves(model, bins, first, std::min(piece, leaves - first), {threads}).to_bytes());
    for (std::size_t i = 0; i < parts.size(); ++i) std::swap(parts[i], parts[(i * 7 + shuffle) % parts.size()]);
    PartialStatistics all = PartialStatistics::from_bytes(parts[0]);
    for (std::size_t i = 1; i < parts.size(); ++i) all.merge(PartialStatistics::from_bytes(parts[i]));
    return all.to_bytes();
}

}  // namespace

TEST(SameBits, ForAnyNumberOfThreads) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options, {1});
    EXPECT_EQ(make_bins(model, options, {3}).to_bytes(), bins.to_bytes());
    const std::string one = bytes_of(run_leaves(model, bins, 0, leaves, {1}));
    for (const int threads : {2, 3, 8}) EXPECT_TRUE(bytes_of(run_leaves(model, bins, 0, leaves, {threads})) == one);
}

TEST(SameBits, ForPiecesOfAnySizeMergedInAnyOrder) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options);
    const std::string whole = bytes_of(run_leaves(model, bins, 0, leaves));
    for (const std::uint64_t piece : {1, 2, 5, 8, 22})
        for (const unsigned shuffle : {0u, 3u})
            EXPECT_TRUE(in_pieces(model, bins, piece, 2, shuffle) == whole) << piece;
}

TEST(SameBits, ForARunStoppedAndGoneOnWith) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options);
    // Says stop at the first question, which comes when some leaves are done.
    PartialStatistics part = run_leaves(model, bins, 0, 100'000, {2, [](std::uint64_t) { return false; }});
    const std::uint64_t end = part.leaves().back().second;
    ASSERT_LT(end, 100'000u);
    std::uint64_t next = 0;
    for (const LeafRange& done : part.leaves()) {
        part.merge(run_leaves(model, bins, next, done.first - next));
        next = done.second;
    }
    EXPECT_EQ(part.leaves(), (std::vector<LeafRange>{{0, end}}));
    EXPECT_TRUE(bytes_of(part) == bytes_of(run_leaves(model, bins, 0, end)));
}

TEST(SameBits, ForRangesComputedByOneThreadEach) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options);
    const auto parts = run_ranges(model, bins, {{0, 5}, {5, 6}, {6, leaves}}, {2});
    ASSERT_EQ(parts.size(), 3u);
    PartialStatistics all(bins);
    for (const PartialStatistics& part : parts) all.merge(part);
    EXPECT_TRUE(bytes_of(all) == bytes_of(run_leaves(model, bins, 0, leaves)));
}

TEST(SameBits, AreThoseOfOneInstructionSetAndOthersAreRefused) {
    const FunctionModel model = curved();
    const std::vector<std::string> targets = instruction_sets();
    const Bins bins = make_bins(model, options);
    const MonteCarloResult fastest = run_leaves(model, bins, 0, leaves).result();
    EXPECT_EQ(fastest.target, targets.front());
    for (std::size_t i = 1; i < targets.size(); ++i) {
        choose_instruction_set(targets[i]);
        EXPECT_THROW(run_leaves(model, bins, 0, 1), InvalidArgument);
        const Bins its_bins = make_bins(model, options);
        const MonteCarloResult result = run_leaves(model, its_bins, 0, leaves).result();
        choose_instruction_set(targets.front());
        EXPECT_EQ(result.target, targets[i]);
        expect_refused([&] { check_same_run(bins, its_bins); }, "expected instruction set " + targets.front());
        // The same samples to rounding: a few of them may fall into the bin beside.
        const auto near = [](const auto& a, const auto& b, double tolerance) {
            return (a - b).cwiseAbs().maxCoeff() < tolerance;
        };
        EXPECT_TRUE(near(result.mean, fastest.mean, 1e-12)) << targets[i];
        EXPECT_TRUE(near(result.standard_uncertainty, fastest.standard_uncertainty, 1e-12)) << targets[i];
        EXPECT_TRUE(near(*result.covariance, *fastest.covariance, 1e-11)) << targets[i];
        EXPECT_TRUE(near(result.symmetric, fastest.symmetric, 1e-3)) << targets[i];
        EXPECT_EQ(result.samples, fastest.samples) << targets[i];
    }
}

TEST(PartialStatistics, OfAnotherRunAreRefusedSayingInWhat) {
    const Bins bins = make_bins(curved(), options);
    PartialStatistics part(bins);
    const auto merge = [&](const FunctionModel& model, const StatisticsOptions& its_options) {
        return [&part, &model, its_options] { part.merge(PartialStatistics(make_bins(model, its_options))); };
    };
    const FunctionModel same = curved(), seed = curved(2), shifted = curved(1, 1e-9);
    StatisticsOptions wider = options;
    wider.coverage = 0.99;
    EXPECT_NO_THROW(merge(same, options)());
    expect_refused(merge(seed, options), "expected seed 1, got 2");
    expect_refused(merge(shifted, options), "another model: over the pilot run square at 2 mm has the mean");
    expect_refused(merge(same, wider), "expected coverage 0.95");
    expect_refused([&] { run_leaves(seed, bins, 0, 1); }, "expected seed 1, got 2");
}

TEST(PartialStatistics, LeavesCountedTwiceAreRefused) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options);
    PartialStatistics part = run_leaves(model, bins, 0, 6);
    const std::string before = part.to_bytes();
    expect_refused([&] { part.merge(run_leaves(model, bins, 5, 3)); }, "leaf 5 of the samples is counted twice");
    expect_refused([&] { part.merge(run_leaves(model, bins, 1, 1)); }, "leaf 1 of the samples is counted twice");
    EXPECT_TRUE(part.to_bytes() == before);  // as it was
    expect_refused([&] { run_leaves(model, bins, largest_leaf_count, 1); }, "leaves: expected");
}

TEST(PartialStatistics, DamagedBytesAreRefused) {
    const FunctionModel model = curved();
    const std::string bytes = run_leaves(model, make_bins(model, options), 0, 2).to_bytes();
    EXPECT_TRUE(PartialStatistics::from_bytes(bytes).to_bytes() == bytes);
    for (const std::size_t place : {std::size_t(30), bytes.size() / 2, bytes.size() - 1}) {
        std::string damaged = bytes;
        damaged[place] = char(damaged[place] ^ 1);
        expect_refused([&] { PartialStatistics::from_bytes(damaged); }, "damaged");
    }
    expect_refused([&] { PartialStatistics::from_bytes(bytes.substr(0, bytes.size() / 2)); }, "damaged");
    expect_refused([] { PartialStatistics::from_bytes(""); }, "expected bytes that begin with");
    expect_refused([&] { Bins::from_bytes(bytes); }, "stepdiag bins");
    expect_refused([&] { AdaptiveProcedure::from_bytes(bytes); }, "stepdiag adaptive");
}

TEST(RunLeaves, ExceptionsOfTheModelAndOfTheQuestionComeThrough) {
    const FunctionModel model = curved();
    const Bins bins = make_bins(model, options);
    const FunctionModel failing(
        [](Eigen::Ref<const Values>, Eigen::Ref<Values>) { throw std::runtime_error("no more ink"); },
        {{DistributionKind::normal, 0.0, 1.0}, {DistributionKind::rectangular, 0.0, 1.0}},
        {{"sum", 1.0, "mm"}, {"square", 2.0, "mm"}}, 1);
    EXPECT_THROW(run_leaves(failing, bins, 0, 5, {2}), std::runtime_error);
    const auto stop = [](std::uint64_t) -> bool { throw std::logic_error("enough"); };
    PartialStatistics part(bins);
    EXPECT_THROW(add_leaves(part, model, 0, 100'000, {2, stop}), std::logic_error);
    // What was done by then stays, and is whole.
    ASSERT_EQ(part.leaves().front().first, 0u);
    const std::uint64_t end = part.leaves().front().second;
    if (part.leaves().size() == 1u) {
        EXPECT_TRUE(bytes_of(part) == bytes_of(run_leaves(model, bins, 0, end)));
    }
    EXPECT_EQ(part.samples() + part.lost(), [&] {
        std::uint64_t leaves_done = 0;
        for (const LeafRange& range : part.leaves()) leaves_done += range.second - range.first;
        return leaves_done * leaf_samples;
    }());
    expect_refused([&] { add_leaves(part, model, 0, 1); }, "leaf 0 of the samples is counted twice");
}

TEST(Adaptive, BlocksHaveTheSizeOfJcgm101) {
    EXPECT_EQ(AdaptiveProcedure::leaves_per_block(0.95), 5u);    // 10^4 samples
    EXPECT_EQ(AdaptiveProcedure::leaves_per_block(0.99), 5u);    // 100 / 0.01 = 10^4
    EXPECT_EQ(AdaptiveProcedure::leaves_per_block(0.999), 50u);  // 10^5
    EXPECT_EQ(AdaptiveProcedure::leaves_per_block(0.9), 5u);
}

TEST(Adaptive, StopsWhereTwiceTheDeviationOfBlockAveragesIsBelowTheTolerance) {
    const FunctionModel model({[](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) { y = x; }},
                              {{DistributionKind::normal, 0.0, 1.05}}, {{"x", 0.0, "1"}}, 2);
    const StatisticsOptions one_digit{0.95, 1};
    const Bins bins = make_bins(model, one_digit);
    AdaptiveProcedure procedure(bins);
    PartialStatistics all(bins);
    Eigen::ArrayXXd figures(0, 4);
    EXPECT_FALSE(procedure.stability(all).stable());
    for (int h = 1; h <= 6; ++h) {
        const LeafRange block = procedure.next_block();
        const PartialStatistics part = run_leaves(model, bins, block.first, block.second - block.first);
        procedure.add(part, all);
        const MonteCarloResult result = part.result();
        figures.conservativeResize(h, 4);
        figures.row(h - 1) << result.mean[0], result.standard_uncertainty[0], result.symmetric.row(0);
        if (h < 2) continue;
        const Eigen::ArrayXXd deviations = figures.rowwise() - figures.colwise().mean();
        const Eigen::ArrayXd s = (deviations.square().colwise().sum() / (h * (h - 1.0))).sqrt().transpose();
        EXPECT_NEAR(procedure.stability(all).ratio, 2.0 * s.maxCoeff() / 0.5, 1e-12);  // u = 1: delta = 0.5
    }
    EXPECT_TRUE(procedure.stability(all).stable());
    EXPECT_EQ(AdaptiveProcedure::from_bytes(procedure.to_bytes()).to_bytes(), procedure.to_bytes());
    expect_refused([&] { procedure.add(all, all); }, "adaptive procedure: expected the leaves 30 to 35");
}
