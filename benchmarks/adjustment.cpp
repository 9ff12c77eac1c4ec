// Benchmarks of the exact adjustment for the run of adjustment_run.hpp, without noise, 50 ... 1,000 steps per axis.
//   adjusted   from the measurement to the calibration with the variance of every value, residuals and redundancies
//   solve      part of `adjusted`: the unknowns, by Gauss-Newton from zero to the limit of double precision
//   variances  part of `adjusted`: variances of all unknowns, by factorisation and inverse on the factor's pattern
//   samples    time per sample of many samples with different noise and set-ups, as in a Monte Carlo run; compared with
//              the adjustment of each sample. Layout ideal or b; the argument is the standard deviation of set-ups,
//              urad
//   one_step   the same with the gain; reports the errors of mean and standard deviation of 2,000 samples, in standard
//              uncertainties
//   exponent   growth exponent of the time of `adjusted` with the number of steps, from 50 to 1,000
// three_quantities: reflector, laser and distance constant of the set-ups are free, all others are fixed; 20 unknowns
// for the diagonals, three for the scale lines. defaults: also lateral offset, roll and gain, and the lasers of scale
// lines, all with priors.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

#include "adjustment/gauss_newton.hpp"
#include "adjustment_run.hpp"
#include "stepdiag/batch/batch_evaluator.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/core/random_blocks.hpp"

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
        stepdiag::GaussNewton solver(problem, {});
        benchmark::DoNotOptimize(solver.solve(x));
    }
}

void variances(benchmark::State& state) {
    const auto problem = problem_of(AdjustmentRun(int(state.range(0))));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.size());
    stepdiag::GaussNewton solver(problem, {});
    solver.solve(x);
    for (auto _ : state) {
        solver.factorize(x);
        benchmark::DoNotOptimize(solver.factor().selected_inverse().diagonal());
    }
}

// Sets of readings with different noise and set-ups, arranged in SIMD lanes.
struct Samples {
    AdjustmentRun bench{50};
    stepdiag::BatchOptions options;
    std::vector<stepdiag::Measurement> runs;
    std::vector<double> readings;  // groups of lane_group sets, one after the other

    Samples(bool layout_b, double angle, int count, bool defaults) {
        if (layout_b) {
            bench.head.layout = stepdiag::HeadLayout::psd;
            bench.head.psd_distance = 200.0;
        }
        bench.head.aperture = 1000.0, bench.head.mirror = {1000.0, 1000.0};  // at 3 mrad no reading is lost
        if (!defaults) options.adjustment = three_quantities();
        options.adjustment.outlier_probability = 0.0;
        options.method = stepdiag::EvaluationMethod::adjustment;
        for (int i = 0; i < count; ++i) runs.push_back(sample(angle, i));
        const std::size_t rows = runs.front().size(), lanes = stepdiag::lane_group;
        readings.resize(3 * rows * runs.size());
        for (std::size_t s = 0; s < runs.size(); ++s)
            for (std::size_t row = 0; row < rows; ++row)
                for (std::size_t c = 0; c < 3; ++c)
                    readings[3 * rows * lanes * (s / lanes) + (3 * row + c) * lanes + s % lanes] =
                        *runs[s].channels()[c].value[row];
    }
    stepdiag::Measurement sample(double angle, int number) const {
        stepdiag::SimulationOptions simulation;
        simulation.noise = {1e-4, 1e-6, 1e-3, std::uint64_t(number)};
        std::uint64_t counter = 100 * std::uint64_t(number);
        for (const char* line : {"ppp", "npp", "pnp", "nnp"})
            for (auto* pair : {&simulation.misalignment[line].reflector, &simulation.misalignment[line].laser}) {
                const auto drawn = stepdiag::normal_pair(5, stepdiag::RandomStream::virtual_calibration, counter++);
                *pair = angle * Eigen::Vector2d(drawn[0], drawn[1]);
            }
        return simulate(bench.machine, bench.plan, bench.head, simulation);
    }
    stepdiag::BatchEvaluator evaluator(stepdiag::EvaluationMethod method) const {
        stepdiag::BatchOptions of_method = options;
        of_method.method = method;
        return {simulate(bench.machine, bench.plan, bench.head, {}),
                bench.plan,
                bench.machine.chain(),
                bench.machine.tool(),
                bench.head.calibration(),
                of_method};
    }
    std::size_t group_size() const { return 3 * runs.front().size() * stepdiag::lane_group; }
};

Eigen::VectorXd uncertainties(const stepdiag::Calibration& calibration) {
    std::vector<double> all;
    for (const auto& function : calibration.functions)
        all.insert(all.end(), function->standard_uncertainty.begin(), function->standard_uncertainty.end());
    for (const auto& squareness : calibration.squarenesses) all.push_back(squareness->standard_uncertainty);
    return Eigen::Map<Eigen::VectorXd>(all.data(), Eigen::Index(all.size()));
}

Eigen::VectorXd tables(const stepdiag::Calibration& calibration) {
    std::vector<double> all;
    for (const auto& function : calibration.functions)
        all.insert(all.end(), function->value.begin(), function->value.end());
    for (const auto& squareness : calibration.squarenesses) all.push_back(squareness->value);
    return Eigen::Map<Eigen::VectorXd>(all.data(), Eigen::Index(all.size()));
}

using Values = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  // values x samples

Values evaluate(const Samples& samples, const stepdiag::BatchEvaluator& evaluator) {
    Values values(evaluator.entries().size(), samples.runs.size());
    stepdiag::BatchEvaluator::Worker worker(evaluator);
    for (std::size_t first = 0; first < samples.runs.size(); first += stepdiag::lane_group)
        worker.evaluate(samples.readings.data() + samples.group_size() * (first / stepdiag::lane_group),
                        stepdiag::lane_group, values.data() + first, samples.runs.size());
    return values;
}

double largest(const Eigen::VectorXd& difference, const Eigen::VectorXd& u) {
    double largest = 0.0;
    for (Eigen::Index e = 0; e < u.size(); ++e)
        if (u[e] > 0.0) largest = std::max(largest, std::abs(difference[e]) / u[e]);
    return largest;
}

void samples(benchmark::State& state, bool defaults) {
    const Samples samples(state.range(0) == 1, 1e-6 * double(state.range(1)), 64, defaults);
    const auto evaluator = samples.evaluator(stepdiag::EvaluationMethod::adjustment);
    const Eigen::VectorXd u = uncertainties(evaluator.of_pattern());
    const Values values = evaluate(samples, evaluator);
    double worst = 0.0;
    for (int s = 0; s < 64; s += 9) {
        const auto alone = samples.bench.adjust(samples.runs[s], samples.options.adjustment).calibration;
        worst = std::max(worst, largest(values.col(s) - tables(alone), u));
    }
    expect_near(worst, 0.0, 1e-4, "values beside those adjusted alone, in standard uncertainties");
    for (auto _ : state) benchmark::DoNotOptimize(evaluate(samples, evaluator));
    state.counters["each"] = benchmark::Counter(64.0 * double(state.iterations()),
                                                benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
    state.counters["worst_u"] = worst;
}

void one_step(benchmark::State& state) {
    constexpr int count = 2000;
    const Samples samples(state.range(0) == 1, 1e-6 * double(state.range(1)), count, true);
    const auto one = samples.evaluator(stepdiag::EvaluationMethod::one_step);
    const Values steps = evaluate(samples, samples.evaluator(stepdiag::EvaluationMethod::adjustment));
    const Values first = evaluate(samples, one);
    const Eigen::VectorXd u = uncertainties(one.of_pattern());
    const auto deviation = [](const Values& v) -> Eigen::VectorXd {
        return ((v.colwise() - v.rowwise().mean()).rowwise().squaredNorm() / (count - 1)).cwiseSqrt();
    };
    for (auto _ : state) benchmark::DoNotOptimize(evaluate(samples, one));
    state.counters["each"] = benchmark::Counter(count * double(state.iterations()),
                                                benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
    state.counters["mean_off_u"] = largest((first - steps).rowwise().mean(), u);
    state.counters["deviation_off_u"] = largest(deviation(first) - deviation(steps), u);
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
void layouts_and_angles(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgNames({"layout_b", "urad"})->ArgsProduct({{0, 1}, {100, 1000, 3000}})->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(samples, three_quantities, false)->Apply(layouts_and_angles);
BENCHMARK_CAPTURE(samples, defaults, true)->Apply(layouts_and_angles);
BENCHMARK(one_step)
    ->Name("slow/one_step")
    ->ArgNames({"layout_b", "urad"})
    ->ArgsProduct({{0, 1}, {10, 30, 100, 300, 1000}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(exponent)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
