// Benchmarks of one detector reading: images and centroids of spots with a radius of 5 and 20 pixels, position sensing
// device, coupled mode.
#include <benchmark/benchmark.h>

#include <cmath>

#include "expect.hpp"
#include "stepdiag/head/interferometer.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace {

using stepdiag::BeamSpot;
using stepdiag::Camera;

constexpr int images = 16;

// An array of 128 x 128 pixels, 1e5 electrons, read noise 1.5.
struct Bench {
    Camera camera;
    BeamSpot spot;

    explicit Bench(double radius) : spot{{0.0031, -0.0042}, 0.01 * radius, 1.0} {
        camera.columns = camera.rows = 128;
        camera.electrons = 1e5;
        camera.read_noise = 1.5;
        camera.shot_noise = true;
    }
    Eigen::MatrixXd image(int i) const { return expose(camera, {spot}, 1, i); }
};

void expose_without_noise(benchmark::State& state) {
    Bench bench(double(state.range(0)));
    bench.camera.shot_noise = false;
    bench.camera.read_noise = 0.0;
    const double half = 0.01 * bench.camera.columns / 2.0;
    expect_near(bench.image(0).sum(), 1e5 * power_inside(bench.spot, {-half, -half}, {half, half}), 1e-8, "electrons");
    for (auto _ : state) benchmark::DoNotOptimize(bench.image(0));
}

void expose_with_noise(benchmark::State& state) {
    const Bench bench(double(state.range(0)));
    const double noise = std::sqrt(1e5 + bench.camera.columns * bench.camera.rows * 1.5 * 1.5);
    expect_near(bench.image(0).sum(), 1e5, 6.0 * noise, "electrons");
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(bench.image(i++ % images));
}

void locate_spot(benchmark::State& state, stepdiag::Centroid centroid, double allowed) {
    Bench bench(double(state.range(0)));
    bench.camera.centroid = centroid;
    const double bound = cramer_rao_bound(bench.camera, bench.spot);
    std::vector<Eigen::MatrixXd> image;
    for (int i = 0; i < images; ++i) {
        image.push_back(bench.image(i));
        expect_near((*locate(bench.camera, image[i]) - bench.spot.centre).norm(), 0.0, allowed * bound, "position");
    }
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(locate(bench.camera, image[i++ % images]));
}

void bound_of_a_spot(benchmark::State& state) {
    const Bench bench(double(state.range(0)));
    // Bound for shot noise only: a quarter of the diameter divided by the root of the electrons. Read noise increases
    // it.
    const double electrons_alone = bench.spot.radius / 2.0 / std::sqrt(1e5);
    if (!(cramer_rao_bound(bench.camera, bench.spot) > electrons_alone))
        expect_near(cramer_rao_bound(bench.camera, bench.spot), electrons_alone, 0.0, "bound");
    for (auto _ : state) benchmark::DoNotOptimize(cramer_rao_bound(bench.camera, bench.spot));
}

void position_device(benchmark::State& state) {
    stepdiag::LateralEffect device;
    const std::vector<BeamSpot> spots{{{0.5, 0.0}, 0.3, 0.9}, {{-2.0, 1.0}, 0.3, 0.1}};
    expect_near(locate(device, spots, 1, 0)->x(), 0.25, 1e-12, "centroid of spot and ghost");
    device.noise = 1e-4;
    std::uint64_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(locate(device, spots, 1, i++));
}

void coupled_mode(benchmark::State& state) {
    const double phi = 300e-6, length = 1200.0;
    const double path = length + length / std::cos(2.0 * phi);
    const stepdiag::GaussianMode mode{1530.0, 0.8, 0.0};
    const stepdiag::ReturnedBeam beam{
        {length * std::tan(2.0 * phi), 0.0}, {std::sin(2.0 * phi), 0.0, -std::cos(2.0 * phi)}, path, path};
    expect_near(couple(mode, beam, 1.0).optical_length, 2.0 * length - length * phi * phi, 1e-9, "path");
    expect_near(couple(mode, beam, 1.0).efficiency, 0.2064, 1e-4, "efficiency");
    for (auto _ : state) benchmark::DoNotOptimize(couple(mode, beam, 1.0));
}

BENCHMARK(expose_without_noise)->Arg(5)->Arg(20)->Unit(benchmark::kMicrosecond);
BENCHMARK(expose_with_noise)->Arg(5)->Arg(20)->Unit(benchmark::kMicrosecond);
// The limit is six standard deviations. The centre of gravity has about 1.1 times the bound at 5 pixels, and more if
// read noise dominates.
BENCHMARK_CAPTURE(locate_spot, gaussian_fit, stepdiag::Centroid::gaussian_fit, 6.0)
    ->Arg(5)
    ->Arg(20)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(locate_spot, centre_of_gravity, stepdiag::Centroid::centre_of_gravity, 24.0)
    ->Arg(5)
    ->Arg(20)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(bound_of_a_spot)->Arg(5)->Arg(20)->Unit(benchmark::kMillisecond);
BENCHMARK(position_device);
BENCHMARK(coupled_mode);

}  // namespace
