// Benchmarks of the pose of a machine with all 21 errors (50 steps per axis), exact and to first order, at random
// points.
#include "stepdiag/machine/machine.hpp"

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "expect.hpp"

namespace {

using Eigen::Vector3d;
using stepdiag::Axis;

const Vector3d volume(800.0, 600.0, 500.0);
constexpr int points = 1024;

struct Bench {
    stepdiag::Machine machine{
        stepdiag::Chain::parse("[w X' b Y Z t]"), stepdiag::make_random_error_map(volume, {}), {5.0, -3.0, 80.0}};
    std::vector<Vector3d> commanded;

    Bench() {
        std::mt19937_64 engine(1);
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        for (int i = 0; i < points; ++i)
            commanded.push_back(volume.cwiseProduct(Vector3d(unit(engine), unit(engine), unit(engine))));
    }

    // The chain as a product of Eigen's transforms.
    Eigen::Isometry3d product(const Vector3d& c) const {
        const auto& map = machine.errors();
        const auto turn = [&](Axis a) {
            const Vector3d theta = map.theta(a, c[index(a)]);
            return theta.norm() > 0.0 ? Eigen::AngleAxisd(theta.norm(), theta.normalized())
                                      : Eigen::AngleAxisd::Identity();
        };
        const auto shift = [&](Axis a) {
            return Eigen::Translation3d(c[index(a)] * Vector3d::Unit(index(a)) + map.delta(a, c[index(a)]));
        };
        return Eigen::Isometry3d(turn(Axis::X) * shift(Axis::X) * shift(Axis::Y) * turn(Axis::Y) * shift(Axis::Z) *
                                 turn(Axis::Z) * Eigen::Translation3d(machine.tool()));
    }
};

void pose(benchmark::State& state) {
    const Bench bench;
    for (const auto& c : bench.commanded)
        expect_near((bench.machine.pose(c).position - bench.product(c).translation()).norm(), 0.0, 1e-12, "pose");
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.machine.pose(bench.commanded[i++ % points]));
}

void first_order_error(benchmark::State& state) {
    const Bench bench;
    for (const auto& c : bench.commanded)  // first order neglects several products of 60 urad x 60 urad x 1 m = 4 nm
        expect_near((bench.machine.first_order_error(c) - bench.machine.error(c)).norm(), 0.0, 100e-6, "error");
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.machine.first_order_error(bench.commanded[i++ % points]));
}

BENCHMARK(pose);
BENCHMARK(first_order_error);

}  // namespace
