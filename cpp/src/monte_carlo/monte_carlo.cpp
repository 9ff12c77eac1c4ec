#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "monte_carlo/leaf_worker.hpp"
#include "monte_carlo/partial_statistics.hpp"
#include "monte_carlo/threads.hpp"

namespace stepdiag {
namespace {

void check_run(const SampleModel& model, const Bins& bins) {
    const Bins::Content& content = bins.content();
    const auto refuse = [](const std::string& what, const std::string& expected, const std::string& got) {
        throw InvalidArgument("the model is not that of the bins: expected " + what + " " + expected + ", got " + got);
    };
    const auto count = [](const auto& list) { return std::to_string(list.size()); };
    if (model.outputs().size() != content.outputs.size())
        refuse("number of outputs", count(content.outputs), count(model.outputs()));
    for (std::size_t i = 0; i < content.outputs.size(); ++i)
        if (model.outputs()[i].name != content.outputs[i].name)
            refuse("output", content.outputs[i].name, model.outputs()[i].name);
    if (model.seed() != content.seed) refuse("seed", std::to_string(content.seed), std::to_string(model.seed()));
    if (model.target() != content.target) refuse("instruction set", content.target, model.target());
}

void check_range(std::uint64_t first, std::uint64_t end) {
    if (end > largest_leaf_count || first > end)
        throw InvalidArgument("leaves: expected " + std::to_string(largest_leaf_count) + " at most (" +
                              std::to_string(largest_leaf_count * leaf_samples) + " samples), got " +
                              std::to_string(first) + " to " + std::to_string(end));
}

}  // namespace

void add_leaves(PartialStatistics& all, const SampleModel& model, std::uint64_t first_leaf, std::uint64_t leaves,
                const RunControl& control) {
    const Bins bins = all.bins();
    check_run(model, bins);
    check_range(first_leaf, std::min(leaves, largest_leaf_count + 1) + first_leaf);
    if (leaves == 0) return;
    all.state().tree.check_free(first_leaf, leaves);
    std::mutex mutex;
    // Counts by thread, since adding them is exact in any order; moments at once, so that few of them wait.
    std::vector<Counts> counts(std::size_t(thread_count(control, leaves)), Counts(bins.content()));
    const auto add_counts = [&] {
        for (Counts& each : counts) {
            each.settle();
            all.state().counts += each;
        }
    };
    try {
        work_through(leaves, control, [&](int thread) -> Work {
            const auto worker = std::make_shared<LeafWorker>(model, bins.content());
            return [&, worker, thread](std::uint64_t item, Progress& progress) {
                auto moments = worker->run(first_leaf + item, counts[std::size_t(thread)], progress.abandon);
                if (!moments) return;
                const std::lock_guard lock(mutex);
                all.state().tree.add(first_leaf + item, {0, std::move(*moments)});
                ++progress.done;
            };
        });
    } catch (...) {
        add_counts();
        throw;
    }
    add_counts();
}

PartialStatistics run_leaves(const SampleModel& model, const Bins& bins, std::uint64_t first_leaf, std::uint64_t leaves,
                             const RunControl& control) {
    PartialStatistics all(bins);
    add_leaves(all, model, first_leaf, leaves, control);
    return all;
}

std::vector<PartialStatistics> run_ranges(const SampleModel& model, const Bins& bins,
                                          const std::vector<LeafRange>& ranges, const RunControl& control) {
    check_run(model, bins);
    for (const LeafRange& range : ranges) check_range(range.first, range.second);
    std::vector<PartialStatistics> parts;
    for (std::size_t i = 0; i < ranges.size(); ++i) parts.emplace_back(bins);
    std::vector<std::uint8_t> whole(ranges.size(), 0);
    work_through(ranges.size(), control, [&](int) -> Work {
        const auto worker = std::make_shared<LeafWorker>(model, bins.content());
        return [&, worker](std::uint64_t item, Progress& progress) {
            PartialStatistics::State& part = parts[item].state();
            for (std::uint64_t leaf = ranges[item].first; leaf < ranges[item].second; ++leaf) {
                auto moments = worker->run(leaf, part.counts, progress.abandon);
                if (!moments || progress.stop) return;
                part.tree.add(leaf, {0, std::move(*moments)});
                ++progress.done;
            }
            part.counts.settle();
            part.counts.recent = {};
            whole[item] = 1;
        };
    });
    std::vector<PartialStatistics> done;
    for (std::size_t i = 0; i < ranges.size(); ++i)
        if (whole[i]) done.push_back(std::move(parts[i]));
    return done;
}

MonteCarloResult monte_carlo(const SampleModel& model, const StatisticsOptions& options, std::uint64_t samples,
                             const RunControl& control) {
    const Bins bins = make_bins(model, options, control);
    return run_leaves(model, bins, 0, (samples + leaf_samples - 1) / leaf_samples, control).result();
}

}  // namespace stepdiag
