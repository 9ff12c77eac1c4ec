// The exact adjustment of the run of adjustment_run.hpp, without noise, 50 ... 1,000 steps per axis.
//   adjusted   from the measurement to the calibration with the variance of every value, residuals and redundancies
//   solve      of that the unknowns alone: Gauss-Newton from zero to the floor of double precision
//   variances  of that the variances of all unknowns: factor and inverse on its pattern
//   follow_up  another noise on the readings of the same plan: the calibration's values again
//   exponent   of `adjusted` against the number of steps, from 50 to 1,000
// three_quantities: reflector, laser and distance constant of the set-ups free, all others fixed, 20 and three
// unknowns; defaults: also lateral offset, roll and gain, and the lasers of scale lines, all of which have priors.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

#include "adjustment_run.hpp"
#include "evaluation/adjustment_solver.hpp"

namespace {

void adjusted(benchmark::State& state, const stepdiag::AdjustmentOptions& options) {
    const AdjustmentRun bench(int(state.range(0)));
    const auto run = bench.run();
    const auto adjustment = bench.adjust(run, options);
    const Eigen::Vector2d worst = bench.worst(adjustment.calibration);
    bench.check(worst);
    expect_near(adjustment.iterations, 0.0, 6.0, "iterations");
    for (auto _ : state) benchmark::DoNotOptimize(bench.adjust(run, options));
    state.counters["mm"] = worst[0];
    state.counters["rad"] = worst[1];
    state.counters["iterations"] = adjustment.iterations;
}

stepdiag::AdjustmentProblem problem_of(const AdjustmentRun& bench) {
    return stepdiag::AdjustmentProblem(bench.run(), bench.plan, bench.machine.chain(), bench.machine.tool(),
                                       bench.head.calibration(), three_quantities());
}

void solve(benchmark::State& state) {
    const auto problem = problem_of(AdjustmentRun(int(state.range(0))));
    for (auto _ : state) {
        Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.size());
        stepdiag::AdjustmentSolver solver(problem, {});
        benchmark::DoNotOptimize(solver.solve(x));
    }
}

void variances(benchmark::State& state) {
    const auto problem = problem_of(AdjustmentRun(int(state.range(0))));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.size());
    stepdiag::AdjustmentSolver solver(problem, {});
    solver.solve(x);
    for (auto _ : state) {
        solver.factorize(x);
        benchmark::DoNotOptimize(solver.factor().selected_inverse().diagonal());
    }
}

void follow_up(benchmark::State& state) {
    const AdjustmentRun bench(int(state.range(0)));
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
            const AdjustmentRun bench(end == 0 ? 50 : 1000);
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
BENCHMARK(solve)->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(variances)->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(follow_up)->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(exponent)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
