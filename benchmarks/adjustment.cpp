// The exact adjustment of a run with the ideal head: four body diagonals of 800 x 600 x 500 mm and three scale lines,
// set-ups up to 1 mrad off, no noise, 50 ... 1,000 steps per axis. All from the measurement to the calibration with the
// variance of every value, residuals and redundancies. Processor time of one thread.
//   three_quantities  of the set-ups reflector, laser and distance constant free, all others fixed: 20 unknowns
//   defaults          also lateral offset, roll and gain, which have priors
//   follow_up         another noise on the readings of the same plan: the calibration's values again
//   exponent          of three_quantities against the number of steps, from 50 to 1,000
#include "stepdiag/evaluation/adjustment.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "expect.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace {

using stepdiag::Line;
using stepdiag::SetupQuantity;

stepdiag::AdjustmentOptions three_quantities() {
    stepdiag::AdjustmentOptions options;
    for (const auto quantity : {SetupQuantity::lateral, SetupQuantity::roll, SetupQuantity::gain})
        options.setup[static_cast<int>(quantity)] = stepdiag::fixed_unknown;
    return options;
}

struct Bench {
    Eigen::Vector3d volume{800.0, 600.0, 500.0};
    stepdiag::Plan plan;
    stepdiag::Head head;
    stepdiag::Machine machine{stepdiag::Chain::parse("[w X' b Y Z t]"), stepdiag::make_random_error_map(volume, {})};

    explicit Bench(int steps)
        : plan(volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")}, steps,
               stepdiag::all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")}) {}

    stepdiag::Measurement run(const stepdiag::Noise& noise = {}) const {
        stepdiag::SimulationOptions options;
        options.noise = noise;
        options.misalignment["ppp"] = {{1e-3, -0.5e-3}, {0.4e-3, 0.8e-3}};
        options.misalignment["npp"] = {{-0.7e-3, 0.2e-3}, {-0.9e-3, 0.1e-3}};
        options.misalignment["pnp"] = {{0.3e-3, 0.6e-3}, {0.2e-3, -1e-3}};
        options.misalignment["nnp"] = {{-0.1e-3, -0.8e-3}, {-0.3e-3, 0.5e-3}};
        return simulate(machine, plan, head, options);
    }
    stepdiag::Adjustment adjust(const stepdiag::Measurement& run, const stepdiag::AdjustmentOptions& options) const {
        return stepdiag::adjust(run, plan, machine.chain(), machine.tool(), head.calibration(), options);
    }

    // Largest deviations from the machine's errors: mm, rad.
    Eigen::Vector2d worst(const stepdiag::Calibration& calibration) const {
        Eigen::Vector2d worst = Eigen::Vector2d::Zero();
        for (int i = 0; i < stepdiag::function_count; ++i) {
            const auto id = stepdiag::FunctionId::at(i);
            const auto& function = calibration.functions[i];
            expect_near(function ? double(function->position.size()) : 0.0, plan.steps() + 1.0, 0.0, "nodes");
            for (std::size_t k = 0; k < function->position.size(); ++k) {
                const double difference = function->value[k] - machine.errors().function(id, function->position[k]);
                worst[id.is_rotation()] = std::max(worst[id.is_rotation()], std::abs(difference));
                if (k > 0 && !(function->standard_uncertainty[k] > 0.0) &&
                    !(id.is_straightness() && k + 1 == function->position.size()))
                    expect_near(0.0, 1.0, 0.0, "a standard uncertainty");
            }
        }
        return worst;
    }

    void check(const stepdiag::Adjustment& adjustment) const {
        // Roundings of 1e-13 mm a reading, of which a function adds up as many as there are steps.
        const double roundings = plan.steps() / 50.0;
        const Eigen::Vector2d worst = this->worst(adjustment.calibration);
        expect_near(worst[0], 0.0, 2e-11 * roundings, "largest error of position");
        expect_near(worst[1], 0.0, 1e-13 * roundings, "largest error of angle");
        expect_near(adjustment.iterations, 0.0, 6.0, "iterations");
    }
};

void adjusted(benchmark::State& state, const stepdiag::AdjustmentOptions& options) {
    const Bench bench(int(state.range(0)));
    const auto run = bench.run();
    const auto adjustment = bench.adjust(run, options);
    bench.check(adjustment);
    for (auto _ : state) benchmark::DoNotOptimize(bench.adjust(run, options));
    const Eigen::Vector2d worst = bench.worst(adjustment.calibration);
    state.counters["mm"] = worst[0];
    state.counters["rad"] = worst[1];
    state.counters["iterations"] = adjustment.iterations;
}

void follow_up(benchmark::State& state) {
    const Bench bench(int(state.range(0)));
    const auto options = three_quantities();
    const auto first = bench.run(), second = bench.run({1e-4, 1e-6, 0.0, 7});
    stepdiag::Adjuster adjuster(first, bench.plan, bench.machine.chain(), bench.machine.tool(),
                                bench.head.calibration(), options);
    Eigen::MatrixXd readings(second.channels().size(), second.size());
    for (Eigen::Index c = 0; c < readings.rows(); ++c)
        for (Eigen::Index row = 0; row < readings.cols(); ++row) readings(c, row) = *second.channels()[c].value[row];
    const Eigen::VectorXd values = adjuster.evaluate(readings);
    Eigen::Index i = 0;
    double worst = 0.0;
    const auto calibration = bench.adjust(second, options).calibration;
    for (const auto& function : calibration.functions)
        for (std::size_t k = 0; k < function->value.size(); ++k, ++i) {
            const double uncertainty = std::max(function->standard_uncertainty[k], 1e-9);  // 0 at the ends
            worst = std::max(worst, std::abs(values[i] - function->value[k]) / uncertainty);
        }
    // Derivatives are those of the first run: off by as much as noise changes angles, some 1e-5, and this the more
    // where unknowns are told apart least.
    expect_near(worst, 0.0, 1e-2, "follow-up, in standard uncertainties");
    for (auto _ : state) benchmark::DoNotOptimize(adjuster.evaluate(readings));
    state.counters["u"] = worst;
}

double processor_time() {
    std::timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

void exponent(benchmark::State& state) {
    const auto options = three_quantities();
    double slope = 0.0;
    for (auto _ : state) {
        Eigen::Vector2d log_time;
        for (const int end : {0, 1}) {
            const Bench bench(end == 0 ? 50 : 1000);
            const auto run = bench.run();
            double best = 1e9;
            for (int repeat = 0; repeat < (end == 0 ? 20 : 5); ++repeat) {
                const double start = processor_time();
                benchmark::DoNotOptimize(bench.adjust(run, options));
                best = std::min(best, processor_time() - start);
            }
            log_time[end] = std::log(best);
        }
        slope = (log_time[1] - log_time[0]) / std::log(1000.0 / 50.0);
    }
    state.counters["exponent"] = slope;
}

void steps(benchmark::internal::Benchmark* benchmark) {
    for (const int steps : {50, 100, 200, 500, 1000}) benchmark->Arg(steps);
    benchmark->Unit(benchmark::kMillisecond);
}

BENCHMARK_CAPTURE(adjusted, three_quantities, three_quantities())->Apply(steps);
BENCHMARK_CAPTURE(adjusted, defaults, {})->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(follow_up)->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(exponent)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
