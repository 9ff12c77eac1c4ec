// Benchmarks of the statistics for 921 outputs (a calibration with 50 steps per axis) of a very cheap model. Processor
// time of one thread. us_a_sample includes the time of model_alone.
#include <benchmark/benchmark.h>

#include <cmath>
#include <limits>
#include <vector>

#include "expect.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace {

using namespace stepdiag;

// Normal numbers from a table, multiplied by a different spread for each output, so that u takes all digits.
class TableModel : public SampleModel {
public:
    explicit TableModel(std::size_t count) {
        for (std::size_t i = 0; i < table_size / 2; ++i)
            for (const double number : normal_pair(1, RandomStream::verification, i)) table_.push_back(number);
        for (std::size_t i = 0; i < count; ++i) {
            outputs_.push_back({"y", double(i), "mm"});
            spread_.push_back(std::pow(10.0, -double(i) / double(count)));
        }
    }
    const std::vector<Output>& outputs() const override { return outputs_; }
    std::uint64_t seed() const override { return 1; }
    std::string target() const override { return "any"; }
    std::unique_ptr<SampleModel::Worker> worker() const override { return std::make_unique<TableWorker>(*this); }

private:
    static constexpr std::size_t table_size = 1 << 14;  // fits a cache

    class TableWorker : public SampleModel::Worker {
    public:
        explicit TableWorker(const TableModel& model) : model_(model) {}
        void evaluate(const SampleBlock& block) override {
            for (std::size_t i = 0; i < model_.outputs_.size(); ++i) {
                const std::size_t from = (block.first_sample * 37 + i * 911) % (table_size - block.samples);
                const double* numbers = model_.table_.data() + from;
                double* to = block.output(i);
                for (std::size_t s = 0; s < block.samples; ++s) to[s] = model_.spread_[i] * numbers[s];
            }
        }

    private:
        const TableModel& model_;
    };
    std::vector<Output> outputs_;
    std::vector<double> table_, spread_;
};

constexpr std::size_t outputs = 921;

void set_rate(benchmark::State& state, std::uint64_t samples) {
    state.counters["us_a_sample"] = benchmark::Counter(double(state.iterations()) * double(samples) * 1e-6,
                                                       benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void model_alone(benchmark::State& state) {
    const TableModel model(outputs);
    const auto worker = model.worker();
    std::vector<double> block(outputs * 80);
    for (auto _ : state) {
        worker->evaluate({0, 80, block.data()});
        benchmark::DoNotOptimize(block.data());
    }
    set_rate(state, 80);
}

void statistics(benchmark::State& state, bool covariance) {
    const TableModel model(outputs);
    StatisticsOptions options;
    options.covariance = covariance;
    const Bins bins = make_bins(model, options, {1});
    PartialStatistics all(bins);
    const std::uint64_t leaves = covariance ? 5 : 50;
    std::uint64_t next = 0;
    for (auto _ : state) {
        add_leaves(all, model, next, leaves, {1});
        next += leaves;
    }
    set_rate(state, leaves * leaf_samples);
    const MonteCarloResult result = all.result();
    expect_near(result.standard_uncertainty[0], 1.0, 0.05, "standard uncertainty");  // of a table of 16,384 numbers
    expect_near(result.symmetric(0, 1), 1.96, 0.1, "upper end");
    state.counters["bins_an_output"] = double(bins.counts()) / double(outputs);
}

void intervals(benchmark::State& state) {
    const TableModel model(outputs);
    const Bins bins = make_bins(model, {}, {1});
    const PartialStatistics all = run_leaves(model, bins, 0, 5, {1});
    for (auto _ : state) benchmark::DoNotOptimize(all.result());
}

}  // namespace

BENCHMARK(model_alone)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(statistics, of_every_output, false)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(statistics, with_covariance, true)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
BENCHMARK(intervals)->Unit(benchmark::kMillisecond);
