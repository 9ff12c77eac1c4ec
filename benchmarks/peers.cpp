// The scene of benchmarks/peers: one beam of a head with a position sensing device. The path from source to sensor has
// 12 interactions: through cube splitter and window to the mirror, and back over the splitting face. peers.py traces
// the scene with other packages as well, and takes the reference results from this program. Times are per interaction
// of the path to the sensor. They include:
//   ray tree  all branches by Embree with powers; every face is searched; the mirror is added to the fixed scene
//   replay    many poses at once: record, replay, verify one in a thousand by ray tree (TracedHead::replay)
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "expect.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace {

using stepdiag::MirrorPose;
using stepdiag::TracedHead;

constexpr int poses = 604, interactions = 12;

TracedHead make_head() {
    stepdiag::HeadDesign design;
    design.layout = stepdiag::HeadLayout::psd;
    const double glass = 1.500902;
    const Eigen::Matrix3d half_turn = stepdiag::rotation_exp({0.0, 0.0, stepdiag::pi});  // sends returned light to +x
    design.bodies = {
        {"splitter", stepdiag::make_cube_splitter(20.0, {glass}), glass, {{0.0, 0.0, -25.0}, half_turn}},
        {"window", stepdiag::make_plate(60.0, 60.0, 6.0, {glass}), glass, {{0.0, 0.0, 20.0}}},
    };
    stepdiag::HeadBeam beam{"laser", {{0.0, 0.0, -60.0}}, {1530.0, 0.8, 0.0}, {}, "psd"};
    design.beams = {beam};
    design.sensors = {{"psd",
                       {{40.0, 0.0, -25.0}, stepdiag::rotation_exp({0.0, 0.5 * stepdiag::pi, 0.0})},
                       stepdiag::LateralEffect{{20.0, 20.0}}}};
    return TracedHead(design, {}, {1.000268}, {100.0, 100.0});
}

// Poses of a mirror from 0.3 to 1.5 m, tilted by up to 1 mrad.
MirrorPose pose(int i) {
    return stepdiag::tilted_mirror({1.4 * std::sin(0.9 * i), 2.1 * std::cos(1.3 * i), 300.0 + 1200.0 * i / (poses - 1)},
                                   0.7e-3 * std::sin(1.7 * i), 0.7e-3 * std::cos(2.3 * i));
}

std::vector<MirrorPose> all_poses() {
    std::vector<MirrorPose> all;
    for (int i = 0; i < poses; ++i) all.push_back(pose(i));
    return all;
}

// Path of the strongest light on the sensor, which is the light from the mirror.
stepdiag::Path traced(const TracedHead& head, const MirrorPose& mirror) {
    const stepdiag::RayTree tree = head.trace(0, mirror);
    return tree.path_to(tree.arrivals(head.detector_face(0)).front());
}

void count(benchmark::State& state, double paths) {
    state.counters["interaction"] = benchmark::Counter(
        paths * interactions, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void ray_tree_with_fixed_mirror(benchmark::State& state) {
    const TracedHead head = make_head();
    for (auto _ : state) benchmark::DoNotOptimize(head.trace(0, pose(poses / 2)));
    count(state, 1);
    state.counters["segments"] = double(head.trace(0, pose(poses / 2)).segments.size());
}

void ray_tree_with_moving_mirror(benchmark::State& state) {
    const TracedHead head = make_head();
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(head.trace(0, pose(i++ % poses)));
    count(state, 1);
}

void replay_with_moving_mirror(benchmark::State& state) {
    const TracedHead head = make_head();
    const auto mirrors = all_poses();
    stepdiag::ReplayCount counted;
    const auto replayed = head.replay(0, mirrors, {}, &counted);
    expect_near(double(counted.replayed), poses, 0.0, "poses replayed");
    for (int i = 0; i < poses; ++i) {
        // Twelve planes, each with a rounding of 1e-13 mm at one metre.
        expect_near(replayed[i][0].beam.optical_length, traced(head, mirrors[i]).optical_length, 5e-12, "path");
        expect_near(double(traced(head, mirrors[i]).hits.size()), interactions, 0.0, "interactions");
    }
    for (auto _ : state) benchmark::DoNotOptimize(head.replay(0, mirrors));
    count(state, poses);
}

// Reports results instead of a time: optical path and position of the spot, mm.
void answer(benchmark::State& state) {
    const TracedHead head = make_head();
    const stepdiag::Path path = traced(head, pose(int(state.range(0))));
    for (auto _ : state) benchmark::ClobberMemory();
    state.counters["path"] = path.optical_length;
    state.counters["y"] = path.hits.back().point.y();
    state.counters["z"] = path.hits.back().point.z();
}

BENCHMARK(ray_tree_with_fixed_mirror);
BENCHMARK(ray_tree_with_moving_mirror);
BENCHMARK(replay_with_moving_mirror);
BENCHMARK(answer)->DenseRange(0, poses - 1, 67)->Iterations(1);

}  // namespace
