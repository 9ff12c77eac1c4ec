// Benchmarks of a compensator, one position at a time, at random points of the volume. The table has 21 errors and 50
// steps per axis (51 nodes; `fine`: 1,000). Results are compared with Machine::error, and commands with their forward.
//   error_vector   the error vector only            command    the compensated position
//   error          error vector and orientation     forward    position of the tool
//   *_chain        each position depends on the previous result: latency of one call
//   *_at_once      many positions in one call; time of one
//   floor          what many errors cannot do without: see Floor
//   trilinear      a peer: interpolation in a table of space (peers/trilinear.c)

#include "stepdiag/controller/compensator.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "controller/compensator_tables.hpp"
#include "expect.hpp"
#include "peers/trilinear.h"
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

// Loads of the intervals' rows, two cache lines for each axis, and the arithmetic of the exact pose of [w X' b Y Z t],
// four positions at once: no search, check, status or choice of a chain, and nodes that are equidistant.
#if defined(__x86_64__)
#define STEPDIAG_FUSED [[gnu::target("avx2,fma")]]
#else
#define STEPDIAG_FUSED
#endif
class Floor {
public:
    explicit Floor(const stepdiag::ParameterTable& table, int intervals) {
        const stepdiag::ErrorMap errors(table);
        for (int a = 0; a < 3; ++a) {
            const stepdiag::AxisTable axis(errors, stepdiag::Axis(a), volume[a], 0.0,
                                           stepdiag::CompensatedApproach::mean);
            for (std::size_t i = 0; i < axis.size(); ++i) rows_[a].push_back(*axis[i].interval);
            per_mm_[a] = intervals / volume[a] * (1.0 - 1e-14);  // the end is in the last interval
        }
    }
    STEPDIAG_FUSED void errors(std::size_t count, const double* positions, double* errors) const noexcept {
        using namespace stepdiag;
        for (std::size_t i = 0; i + 4 <= count; i += 4) {
            const Vector3Of<Four> p = read_four(positions + 3 * i);
            const auto x = at(0, p.x), y = at(1, p.y), z = at(2, p.z);
            Vector3Of<Four> lever = broadcast<Four>(Vector3{tool[0], tool[1], tool[2]});
            Vector3Of<Four> d = add_turn(z.delta, z.theta, z.sine, lever);
            lever.z += p.z;
            d = add_turn(d + y.delta, y.theta, y.sine, lever + d);
            lever.y += p.y;
            lever.x += p.x;
            d = d + x.delta;
            write_four(add_turn(d, x.theta, x.sine, lever + d), errors + 3 * i);
        }
    }

private:
    STEPDIAG_INLINED stepdiag::AxisErrors<stepdiag::Four> at(int a, const stepdiag::Four& p) const noexcept {
        using Indices = std::int32_t __attribute__((vector_size(16)));
        const auto i = __builtin_convertvector(p * per_mm_[a], Indices);
        const auto* const rows = rows_[a].data();
        return stepdiag::FourPlaces{{rows + i[0], {}}, {rows + i[1], {}}, {rows + i[2], {}}, {rows + i[3], {}}}.at(p);
    }

    std::vector<stepdiag::AxisInterval> rows_[3];
    double per_mm_[3];
};

template <class Job>
double seconds_of(Job&& job) {
    const auto start = std::chrono::steady_clock::now();
    job();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// `ratio`: time of Compensator::errors to that of the floor, of both the fastest of runs that take turns.
void floor(benchmark::State& state) {
    const int intervals = int(state.range(0));
    const Bench bench(intervals);
    const Floor floor(bench.parameters, intervals);
    std::vector<Position> answers(points), own(points);
    std::vector<unsigned> statuses(points);
    const auto ask_floor = [&] { floor.errors(points, bench.positions[0].data(), answers[0].data()); };
    const auto ask_own = [&] {
        bench.compensator.errors(points, bench.positions[0].data(), tool.data(), nullptr, own[0].data(), nullptr,
                                 statuses.data());
    };
    double fastest_floor = 1.0, fastest_own = 1.0;
    for (int turn = 0; turn < 500; ++turn) {
        fastest_floor = std::min(fastest_floor, seconds_of(ask_floor));
        fastest_own = std::min(fastest_own, seconds_of(ask_own));
    }
    for (std::size_t i = 0; i < points; ++i)
        expect_near((vector(answers[i]) - vector(own[i])).norm(), 0.0, 1e-15, "floor");
    for (auto _ : state) {
        ask_floor();
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * std::int64_t(points));
    state.counters["ratio"] = fastest_own / fastest_floor;
}

// Errors at n nodes of each axis, one position after the other and many at once; `rms` and `largest` are the lengths of
// differences from the exact errors, mm. With 9 nodes the table has the size of the compensator's, 18 kB.
struct Trilinear {
    std::vector<Position> errors;
    trilinear_table table;

    Trilinear(const stepdiag::Compensator& compensator, int n)
        : table{n, {(n - 1) / volume[0], (n - 1) / volume[1], (n - 1) / volume[2]}, nullptr} {
        const Vector3d step = volume / (n - 1);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k) {
                    const Vector3d p = step.cwiseProduct(Vector3d(i, j, k)).cwiseMin(volume);
                    errors.push_back(compensator.error(Position{p[0], p[1], p[2]}, tool).position);
                }
        table.errors = errors[0].data();
    }
};

void trilinear(benchmark::State& state) {
    const Bench bench(50);
    const Trilinear peer(bench.compensator, int(state.range(0)));
    std::size_t i = 0;
    Position answer;
    for (auto _ : state) {
        trilinear_error(&peer.table, bench.positions[i++ % points].data(), answer.data());
        benchmark::DoNotOptimize(answer);
    }
}
void trilinear_at_once(benchmark::State& state) {
    const Bench bench(50);
    const Trilinear peer(bench.compensator, int(state.range(0)));
    std::vector<Position> answers(points);
    for (auto _ : state) {
        trilinear_errors(&peer.table, points, bench.positions[0].data(), answers[0].data());
        benchmark::ClobberMemory();
    }
    double largest2 = 0.0, sum2 = 0.0;
    for (std::size_t i = 0; i < points; ++i) {
        const Vector3d exact = vector(bench.compensator.error(bench.positions[i], tool).position);
        const double difference2 = (vector(answers[i]) - exact).squaredNorm();
        largest2 = std::max(largest2, difference2), sum2 += difference2;
    }
    state.SetItemsProcessed(state.iterations() * std::int64_t(points));
    state.counters["largest"] = std::sqrt(largest2), state.counters["rms"] = std::sqrt(sum2 / points);
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

// These have the instructions that the compensator selects.
[[maybe_unused]] const bool are_registered = [] {
    if (!stepdiag::are_fused_answers_known()) return false;
    benchmark::RegisterBenchmark("floor", floor)->Arg(50);
    benchmark::RegisterBenchmark("trilinear", trilinear)->Arg(9)->Arg(51);
    benchmark::RegisterBenchmark("trilinear_at_once", trilinear_at_once)->Arg(9)->Arg(51);
    return true;
}();

}  // namespace
