// Benchmarks of a compensator, one position at a time, at random points of the volume. The table has 21 errors and 50
// steps per axis (51 nodes; `fine`: 1,000). Results are compared with Machine::error, and commands with their forward.
//   error_vector   the error vector only            command    the compensated position
//   error          error vector and orientation     forward    position of the tool
//   *_chain        each position depends on the previous result: latency of one call

#include "stepdiag/controller/compensator.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <vector>

#include "expect.hpp"
#include "stepdiag/machine/machine.hpp"

namespace {

using Eigen::Vector3d;
using Position = std::array<double, 3>;

const char* const chain = "wX'bYZt";
const Vector3d volume(800.0, 600.0, 500.0), tool_offset(5.0, -3.0, 80.0);
const Position tool = {5.0, -3.0, 80.0};
constexpr std::size_t points = 4096;

Vector3d vector(const Position& p) { return {p[0], p[1], p[2]}; }

stepdiag::ParameterTable table(int intervals) {
    stepdiag::RandomErrorMap options;
    options.intervals = intervals;
    stepdiag::ParameterTable table = stepdiag::make_random_error_map(volume, options).table();
    table.header = {{"chain", "[w X' b Y Z t]"},
                    {"volume_mm", stepdiag::format_lengths(volume)},
                    {"tool_mm", stepdiag::format_lengths(tool_offset)}};
    return table;
}

struct Bench {
    stepdiag::ParameterTable parameters;
    stepdiag::Compensator compensator;
    std::vector<Position> positions;

    explicit Bench(int intervals) : parameters(table(intervals)), compensator(parameters, "random machine", chain) {
        std::mt19937_64 engine(1);
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        for (std::size_t i = 0; i < points; ++i)
            positions.push_back({800.0 * unit(engine), 600.0 * unit(engine), 500.0 * unit(engine)});
        const stepdiag::Machine machine(stepdiag::Chain::parse(chain), stepdiag::ErrorMap(parameters), tool_offset);
        for (const Position& p : positions) {
            // Machine adds positions of 1,000 mm, each with a rounding of 1e-13 mm.
            const Vector3d e = vector(compensator.error(p, tool).position);
            expect_near((e - machine.error(vector(p))).norm(), 0.0, 2e-12, "error");
            const Vector3d back = vector(compensator.forward(compensator.command(p, tool).position, tool).position);
            expect_near((back - vector(p)).norm(), 0.0, compensator.inverse_bound(), "forward(command)");
        }
    }
};

template <class Ask>
void run(benchmark::State& state, int intervals, Ask&& ask) {
    const Bench bench(intervals);
    std::size_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(ask(bench.compensator, bench.positions[i++ % points]));
}

// Each position depends on the previous result.
template <class Ask>
void run_chain(benchmark::State& state, Ask&& ask) {
    const Bench bench(50);
    std::size_t i = 0;
    double last = 0.0;
    for (auto _ : state) {
        Position p = bench.positions[i++ % points];
        p[0] += 1e-30 * last;
        last = ask(bench.compensator, p).position[0];
    }
    benchmark::DoNotOptimize(last);
}

const auto ask_vector = [](const stepdiag::Compensator& c, const Position& p) {
    stepdiag::CompensatedPosition answer;
    answer.status = c.error(p.data(), tool.data(), answer.position.data(), nullptr);
    return answer;
};
const auto ask_error = [](const stepdiag::Compensator& c, const Position& p) { return c.error(p, tool); };
const auto ask_command = [](const stepdiag::Compensator& c, const Position& p) { return c.command(p, tool); };
const auto ask_forward = [](const stepdiag::Compensator& c, const Position& p) { return c.forward(p, tool); };

void error_vector(benchmark::State& state) { run(state, 50, ask_vector); }
void error_vector_chain(benchmark::State& state) { run_chain(state, ask_vector); }
void error_vector_fine(benchmark::State& state) { run(state, 1000, ask_vector); }
void error(benchmark::State& state) { run(state, 50, ask_error); }
void command(benchmark::State& state) { run(state, 50, ask_command); }
void forward(benchmark::State& state) { run(state, 50, ask_forward); }
void command_fine(benchmark::State& state) { run(state, 1000, ask_command); }
void command_chain(benchmark::State& state) { run_chain(state, ask_command); }
void forward_chain(benchmark::State& state) { run_chain(state, ask_forward); }

// Many positions in one call: time of one. `statuses` are asked for, orientations are not.
void errors_at_once(benchmark::State& state) {
    const Bench bench(int(state.range(0)));
    std::vector<Position> answers(points);
    std::vector<unsigned> statuses(points);
    for (auto _ : state) {
        bench.compensator.errors(points, bench.positions[0].data(), tool.data(), nullptr, answers[0].data(), nullptr,
                                 statuses.data());
        benchmark::ClobberMemory();
    }
    for (std::size_t i = 0; i < points; ++i)
        expect_near((vector(answers[i]) - vector(bench.compensator.error(bench.positions[i], tool).position)).norm(),
                    0.0, 1e-15, "errors at once");
    state.SetItemsProcessed(state.iterations() * std::int64_t(points));
}
void commands_at_once(benchmark::State& state) {
    const Bench bench(int(state.range(0)));
    std::vector<Position> answers(points);
    std::vector<unsigned> statuses(points);
    for (auto _ : state) {
        bench.compensator.commands(points, bench.positions[0].data(), tool.data(), nullptr, answers[0].data(),
                                   statuses.data());
        benchmark::ClobberMemory();
    }
    for (std::size_t i = 0; i < points; ++i)
        expect_near((vector(bench.compensator.forward(answers[i], tool).position) - vector(bench.positions[i])).norm(),
                    0.0, bench.compensator.inverse_bound(), "commands at once");
    state.SetItemsProcessed(state.iterations() * std::int64_t(points));
}

// Time of an error vector from Machine, which searches each of the eighteen tables.
void machine_error(benchmark::State& state) {
    const Bench bench(50);
    const stepdiag::Machine machine(stepdiag::Chain::parse(chain), stepdiag::ErrorMap(bench.parameters), tool_offset);
    std::size_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(machine.error(vector(bench.positions[i++ % points])));
}

BENCHMARK(error_vector);
BENCHMARK(error_vector_chain);
BENCHMARK(error_vector_fine);
BENCHMARK(error);
BENCHMARK(command);
BENCHMARK(command_chain);
BENCHMARK(command_fine);
BENCHMARK(forward);
BENCHMARK(forward_chain);
BENCHMARK(errors_at_once)->Arg(50)->Arg(1000);
BENCHMARK(commands_at_once)->Arg(50)->Arg(1000);
BENCHMARK(machine_error);

}  // namespace
