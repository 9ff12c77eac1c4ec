// Benchmarks from one Embree query to a traced reading, compared with the closed definition of the same reading, and of
// a moving mirror in front of a head with many faces.
#include <benchmark/benchmark.h>

#include <vector>

#include "expect.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/head/head.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/plan/line.hpp"
#include "support/traced_mirror.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Surface;

constexpr int poses = 64;

// A head on the body diagonal of 800 x 600 x 500 mm, misaligned as in the paper, and poses of the tool along it.
struct Bench {
    stepdiag::Head head;
    Matrix3d frame = stepdiag::line_frame(stepdiag::Line::parse("ppp"), {800.0, 600.0, 500.0});
    stepdiag::HeadSetup setup =
        set_up(head, frame, Vector3d::Zero(), {80.0, 80.0}, {{100e-6, 300e-6}, {700e-6, 1000e-6}, {0.0, 0.0}});
    stepdiag::Medium air{1.000268};
    std::vector<Vector3d> point;
    std::vector<Matrix3d> rotation;

    Bench() {
        for (int i = 0; i < poses; ++i) {
            point.push_back(frame * Vector3d(9.6 * (i % 3) / 2.0, 8.9 * (i % 2), 1118.0 * i / poses));
            rotation.push_back(stepdiag::rotation_exp({1e-6 * i, -60e-6, 30e-6}));
        }
    }

    stepdiag::Scene scene(int i) const {
        return stepdiag::Scene(
            {make_rectangle(point[i], rotation[i] * setup.tool_R_mirror, setup.mirror, Surface::reflecting),
             make_rectangle(setup.origin, setup.machine_R_sensor, {50.0, 50.0}, Surface::absorbing)});
    }
    stepdiag::Ray beam() const { return {setup.origin, setup.machine_R_sensor.col(2)}; }
    stepdiag::Reading closed(int i) const {
        const auto mirror = mirror_in_sensor_frame(setup, point[i], rotation[i]);
        return *stepdiag::read_mirror(mirror.point, mirror.rotation.col(2));
    }
    stepdiag::Reading traced(int i) const {
        return stepdiag::test::trace_beam(head, setup, {0.0, 0.0}, point[i], rotation[i], air)->reading();
    }
};

void embree_query(benchmark::State& state) {
    const Bench bench;
    std::vector<stepdiag::Scene> scenes;
    for (int i = 0; i < poses; ++i) scenes.push_back(bench.scene(i));
    for (int i = 0; i < poses; ++i)
        expect_near(scenes[i].first_hit(bench.beam())->distance, bench.closed(i).beam_length(), 5e-12, "beam length");
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(scenes[i++ % poses].first_hit(bench.beam()));
}

void scene_of_two_faces(benchmark::State& state) {
    const Bench bench;
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.scene(i++ % poses));
}

void path_through_a_scene(benchmark::State& state) {
    const Bench bench;
    std::vector<stepdiag::Scene> scenes;
    for (int i = 0; i < poses; ++i) scenes.push_back(bench.scene(i));
    for (int i = 0; i < poses; ++i)
        expect_near(trace(scenes[i], bench.air, bench.beam()).geometric_length, 2.0 * bench.closed(i).distance, 1e-11,
                    "round trip");
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(trace(scenes[i++ % poses], bench.air, bench.beam()));
}

void traced_reading_with_its_scene(benchmark::State& state) {
    const Bench bench;
    for (int i = 0; i < poses; ++i) {
        const auto traced = bench.traced(i), closed = bench.closed(i);
        expect_near(traced.distance, closed.distance, 5e-12, "distance");
        expect_near(traced.alpha, closed.alpha, 1e-14, "alpha");
        expect_near(traced.beta, closed.beta, 1e-14, "beta");
    }
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.traced(i++ % poses));
}

void closed_definition_of_a_reading(benchmark::State& state) {
    const Bench bench;
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.closed(i++ % poses));
}

// Squares in rows of ten along z. Each row is a plane.
std::vector<stepdiag::Face> squares(int count) {
    std::vector<stepdiag::Face> faces;
    for (int i = 0; i < count; ++i)
        faces.push_back(make_rectangle({2.0 * (i % 10) - 9.0, 0.0, -1.0 * (i / 10)}, Matrix3d::Identity(), {1.5, 1.5},
                                       Surface::absorbing));
    return faces;
}

stepdiag::Face moving_mirror(int i) {
    return make_rectangle({0.0, 0.0, 300.0 + i % poses}, stepdiag::rotation_exp({1e-6 * (i % poses), 0.0, 0.0}),
                          {80, 80}, Surface::reflecting);
}

void new_scene(benchmark::State& state) {
    const auto fixed = squares(int(state.range(0)));
    int i = 0;
    for (auto _ : state) {
        auto faces = fixed;
        faces.push_back(moving_mirror(i++));
        benchmark::DoNotOptimize(stepdiag::Scene(std::move(faces)));
    }
}

void scene_with_another_mirror(benchmark::State& state) {
    const stepdiag::Scene fixed(squares(int(state.range(0))));
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(fixed.with({moving_mirror(i++)}));
}

// One query that meets the mirror, and one that meets a fixed face.
void query_of(benchmark::State& state, const stepdiag::Scene& scene) {
    const stepdiag::Ray out{{1.0, 0.0, 5.0}, Vector3d::UnitZ()}, back{{1.0, 0.0, 5.0}, -Vector3d::UnitZ()};
    expect_near(scene.first_hit(out)->distance, 295.0, 1e-12, "distance of the mirror");
    expect_near(scene.first_hit(back)->distance, 5.0, 1e-12, "distance of a square");
    for (auto _ : state) {
        benchmark::DoNotOptimize(scene.first_hit(out));
        benchmark::DoNotOptimize(scene.first_hit(back));
    }
}

void two_queries(benchmark::State& state) {
    auto faces = squares(int(state.range(0)));
    faces.push_back(moving_mirror(0));
    query_of(state, stepdiag::Scene(faces));
}

void two_queries_with_the_mirror_added(benchmark::State& state) {
    query_of(state, stepdiag::Scene(squares(int(state.range(0)))).with({moving_mirror(0)}));
}

BENCHMARK(new_scene)->Arg(10)->Arg(40)->Arg(1000);
BENCHMARK(scene_with_another_mirror)->Arg(10)->Arg(40)->Arg(1000);
BENCHMARK(two_queries)->Arg(10)->Arg(40)->Arg(1000);
BENCHMARK(two_queries_with_the_mirror_added)->Arg(10)->Arg(40)->Arg(1000);
BENCHMARK(embree_query);
BENCHMARK(scene_of_two_faces);
BENCHMARK(path_through_a_scene);
BENCHMARK(traced_reading_with_its_scene);
BENCHMARK(closed_definition_of_a_reading);

}  // namespace
