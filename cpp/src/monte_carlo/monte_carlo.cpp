#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>

#include "monte_carlo/leaf_worker.hpp"
#include "monte_carlo/partial_statistics.hpp"
#include "monte_carlo/threads.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random_blocks.hpp"

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
    // Each thread has its own counts, because their addition is exact in any order. Moments are added to the tree
    // immediately, so that few nodes wait for merging.
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

// --- pilot run: reference mean and bins of each output ---

namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& expected, const std::string& got) {
    throw InvalidArgument(what + ": expected " + expected + ", got " + got);
}

void check_outputs(const std::string& what, const std::vector<std::size_t>& outputs, std::size_t count) {
    std::vector<std::size_t> sorted = outputs;
    std::sort(sorted.begin(), sorted.end());
    for (const std::size_t output : sorted)
        if (output >= count) refuse(what, "outputs 0 to " + std::to_string(count - 1), std::to_string(output));
    if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
        throw InvalidArgument(what + ": output " + std::to_string(*twice) + " is given twice");
}

void check_options(const StatisticsOptions& options, std::size_t outputs) {
    if (!(options.coverage > 0.0 && options.coverage < 1.0))
        refuse("coverage", "a probability between 0 and 1", std::to_string(options.coverage));
    if (options.digits < 1 || options.digits > 3) refuse("digits", "1 to 3", std::to_string(options.digits));
    check_outputs("kept", options.kept, outputs);
    for (const auto& set : options.joint) {
        if (set.empty() || set.size() > 3)
            refuse("joint", "sets of one to three outputs", "one of " + std::to_string(set.size()));
        check_outputs("joint", set, outputs);
    }
}

// Outputs of the first sample with a result. They are near enough to the mean to serve as reference for the sums.
Eigen::VectorXd first_result(const SampleModel& model) {
    const std::size_t outputs = model.outputs().size();
    std::vector<double> values(outputs * lane_group);
    const auto worker = model.worker();
    for (std::uint64_t first = 0; first < pilot_samples; first += lane_group) {
        worker->evaluate({first, lane_group, values.data()});
        for (std::size_t s = 0; s < lane_group; ++s) {
            Eigen::VectorXd result(outputs);
            for (std::size_t i = 0; i < outputs; ++i) result[Eigen::Index(i)] = values[i * lane_group + s];
            if (result.allFinite()) return result;
        }
    }
    throw InvalidArgument("none of the first " + std::to_string(pilot_samples) +
                          " samples has a result, so there are no statistics");
}

// Provisional bins for the pilot run: minimal bins about `centre`. The values of the joint outputs are kept.
Bins provisional_bins(const SampleModel& model, const StatisticsOptions& options, const Eigen::VectorXd& centre) {
    auto content = std::make_shared<Bins::Content>();
    content->outputs = model.outputs();
    content->seed = model.seed();
    content->target = model.target();
    for (const auto& set : options.joint) {
        auto& kept = content->options.kept;
        kept.insert(kept.end(), set.begin(), set.end());
        std::sort(kept.begin(), kept.end());
        kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    }
    for (const double value : centre) {
        content->by_output.push_back({value, 0.0, value, value, value, 1.0, 1, content->counts});
        content->counts += 3;
    }
    return Bins(content);
}

Eigen::MatrixXd values_of(const std::vector<std::size_t>& outputs, const MonteCarloResult& pilot) {
    Eigen::MatrixXd values(outputs.size(), pilot.samples);
    for (std::size_t j = 0; j < outputs.size(); ++j) {
        Eigen::Index column = 0;
        for (const double value : pilot.kept.at(outputs[j]))
            if (!std::isnan(value)) values(Eigen::Index(j), column++) = value;
    }
    return values;
}

}  // namespace

Bins make_bins(const SampleModel& model, const StatisticsOptions& options, const RunControl& control) {
    check_options(options, model.outputs().size());
    if (model.outputs().empty()) throw InvalidArgument("the model has no outputs");
    const Bins provisional = provisional_bins(model, options, first_result(model));
    const PartialStatistics part = run_leaves(model, provisional, 0, pilot_samples / leaf_samples, control);
    if (part.leaves() != std::vector<LeafRange>{{0, pilot_samples / leaf_samples}})
        throw InvalidArgument("the pilot run was stopped before its end");
    const MonteCarloResult pilot = part.result();

    auto content = std::make_shared<Bins::Content>();
    content->outputs = model.outputs();
    content->options = options;
    content->seed = model.seed();
    content->target = model.target();
    for (Eigen::Index i = 0; i < pilot.mean.size(); ++i) {
        const double u = pilot.samples > 1 ? pilot.standard_uncertainty[i] : 0.0;
        OutputBins bins = bins_of(pilot.mean[i], u, pilot.lowest[i], pilot.highest[i], options.digits);
        bins.offset = content->counts;
        content->counts += bins.bins + 2;
        content->by_output.push_back(bins);
    }
    for (const auto& set : options.joint) content->joint.push_back(joint_bins(set, values_of(set, pilot)));
    return Bins(content);
}

}  // namespace stepdiag
