// Benchmarks of simulation and evaluation for the demonstration's run: 604 readings on four diagonals of 800 x 600 x
// 500 mm, and six on scale lines.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "expect.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace {

using stepdiag::Line;

struct Bench {
    Eigen::Vector3d volume{800.0, 600.0, 500.0};
    stepdiag::Plan plan{volume,
                        {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")},
                        50,
                        stepdiag::all_axes,
                        {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")}};
    stepdiag::Head head;
    stepdiag::Machine machine{stepdiag::Chain::parse("[w X' b Y Z t]"), stepdiag::make_random_error_map(volume, {})};
    stepdiag::Measurement run = simulate(machine, plan, head);

    stepdiag::Calibration enhanced(bool full_covariance = false) const {
        stepdiag::EvaluationOptions options;
        options.full_covariance = full_covariance;
        return evaluate_enhanced(run, plan, machine.chain(), machine.tool(), head.calibration(), options);
    }
    stepdiag::Calibration conventional(bool full_covariance = false) const {
        stepdiag::EvaluationOptions options;
        options.full_covariance = full_covariance;
        return evaluate_conventional(run, plan, machine.chain(), machine.tool(), head.calibration(), options);
    }

    // Largest deviation of the translations from the machine's errors, mm.
    double worst_position(const stepdiag::Calibration& calibration) const {
        double worst = 0.0;
        for (int i = 0; i < stepdiag::function_count; ++i) {
            const auto id = stepdiag::FunctionId::at(i);
            const auto& function = calibration.functions[i];
            for (std::size_t k = 0; function && !id.is_rotation() && k < function->position.size(); ++k)
                worst = std::max(worst,
                                 std::abs(function->value[k] - machine.errors().function(id, function->position[k])));
        }
        return worst;
    }
};

void simulate_the_demo_run(benchmark::State& state) {
    const Bench bench;
    for (const auto& value : bench.run.find("distance")->value)
        expect_near(value ? 0.0 : 1.0, 0.0, 0.0, "lost readings");
    expect_near(double(bench.run.size()), 4 * 151 + 6, 0.0, "number of readings");
    for (auto _ : state) benchmark::DoNotOptimize(simulate(bench.machine, bench.plan, bench.head));
}

void evaluate_enhanced(benchmark::State& state) {
    const Bench bench;
    expect_near(bench.worst_position(bench.enhanced()), 0.0, 15e-6, "enhanced: largest error of position");
    for (auto _ : state) benchmark::DoNotOptimize(bench.enhanced());
}

void evaluate_enhanced_with_full_covariance(benchmark::State& state) {
    const Bench bench;
    const auto calibration = bench.enhanced(true);
    const auto& exx = *calibration.functions[0];
    expect_near(std::sqrt(calibration.covariance(50, 50)), exx.standard_uncertainty[50], 1e-12, "u(EXX) at the end");
    for (auto _ : state) benchmark::DoNotOptimize(bench.enhanced(true));
}

void evaluate_conventional(benchmark::State& state) {
    const Bench bench;
    if (bench.worst_position(bench.conventional()) < 10e-3)
        expect_near(0.0, 1.0, 0.0, "conventional: angles should spoil it");
    for (auto _ : state) benchmark::DoNotOptimize(bench.conventional());
}

void evaluate_conventional_with_full_covariance(benchmark::State& state) {
    const Bench bench;
    for (auto _ : state) benchmark::DoNotOptimize(bench.conventional(true));
}

BENCHMARK(simulate_the_demo_run)->Unit(benchmark::kMillisecond);
BENCHMARK(evaluate_enhanced)->Unit(benchmark::kMillisecond);
BENCHMARK(evaluate_enhanced_with_full_covariance)->Unit(benchmark::kMillisecond);
BENCHMARK(evaluate_conventional)->Unit(benchmark::kMillisecond);
BENCHMARK(evaluate_conventional_with_full_covariance)->Unit(benchmark::kMillisecond);

}  // namespace
