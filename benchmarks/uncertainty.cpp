// Benchmarks of complete virtual calibrations per second on one core: 50 steps, four body diagonals and three scale
// lines (610 poses), enhanced evaluation. The set-up angles of every diagonal and the noise of every reading are
// uncertain. The heads are the ideal one-beam head, and a ray-traced head like the shipped layout b
// (beam_and_psd.toml).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "expect.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"
#include "stepdiag/uncertainty/virtual_calibration.hpp"
#include "uncertainty/simd_sampler.hpp"

namespace {

using namespace stepdiag;

constexpr int steps = 50;
constexpr std::uint64_t seed = 1;
constexpr std::size_t block = 80;  // block size of the statistics: 0.6 MB of outputs

// python/stepdiag/head/shipped/beam_and_psd.toml
Head layout_b() {
    const auto turned = [](const Eigen::Vector3d& degrees) { return rotation_exp(degrees * pi / 180.0); };
    const auto body = [&](const char* name, std::vector<Face> faces, Material material, const Eigen::Vector3d& position,
                          const Eigen::Vector3d& degrees) {
        return HeadBody{name, std::move(faces), std::move(material), {position, turned(degrees)}};
    };
    HeadDesign design{"beam and PSD", HeadLayout::psd, {}, {}, {}, {}};
    design.bodies = {
        body("splitter", make_cube_splitter(20.0, {}), find_glass("N-BK7"), {25.0, 0.0, -20.0}, {0.0, 0.0, 180.0}),
        body("dump", make_screen(16.0, 16.0), 1.0, {13.0, 0.0, -20.0}, {0.0, 90.0, 0.0}),
        body("window", make_plate(60.0, 40.0, 5.0, {}), find_glass("N-BK7"), {12.5, 0.0, 12.5}, {0.0, 0.0, 0.0})};
    HeadBeam beam{"interferometer", {}, {1530.0, 0.8, 0.0}, Interferometer{}, ""};
    beam.interferometer->acceptance = 5e-3;
    HeadBeam laser{"laser", {{25.0, 0.0, -40.0}, Eigen::Matrix3d::Identity()}, {635.0, 0.5, 600.0}, {}, "psd"};
    design.beams = {beam, laser};
    design.sensors = {{"psd", {{45.0, 0.0, -20.0}, turned({0.0, 90.0, 0.0})}, LateralEffect{{20.0, 20.0}}}};
    return make_head(design, 150.0);
}

enum class Layout { one_beam, b };

VirtualRun run_of(Layout layout) {
    const Eigen::Vector3d volume(800.0, 600.0, 500.0);
    RandomErrorMap errors;
    errors.seed = 1;
    const Heads heads(layout == Layout::b ? layout_b() : Head{});
    VirtualRun run{Machine(Chain::parse("[w X' b Y Z t]"), make_random_error_map(volume, errors)),
                   Plan(volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")}, steps,
                        all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")}),
                   heads,
                   heads.calibration(),
                   {},
                   {}};
    for (const Line& line : run.plan.lines())
        for (int k = 0; k < 2; ++k)
            for (const InputQuantity quantity : {InputQuantity::reflector, InputQuantity::laser})
                run.inputs.inputs.push_back({quantity, {DistributionKind::normal, 0.0, 100e-6}, line.name(), {}, k});
    for (const std::string& channel : signal_names(heads.head)) {
        const double sigma = channel == "distance" ? 0.1e-3 : channel.front() == 's' ? 1e-3 : 1e-6;
        run.inputs.noise.push_back({NoiseQuantity::channel, {DistributionKind::normal, 0.0, sigma}, channel});
    }
    return run;
}

const VirtualCalibrations& model_of(Layout layout) {
    static std::map<Layout, std::unique_ptr<VirtualCalibrations>> models;
    auto& model = models[layout];
    if (!model) model = std::make_unique<VirtualCalibrations>(run_of(layout), BatchOptions{}, seed);
    return *model;
}

void count(benchmark::State& state, double calibrations) {
    state.counters["calibrations/s"] = benchmark::Counter(calibrations, benchmark::Counter::kIsIterationInvariantRate);
}

// Compares a sample with simulate() for its drawn inputs, plus its noise, and evaluate_enhanced().
void check(Layout layout) {
    const VirtualRun run = run_of(layout);
    const VirtualCalibrations& model = model_of(layout);
    if (!model.is_in_lanes()) expect_near(0.0, 1.0, 0.0, "replay in lanes");
    std::vector<double> outputs(model.outputs().size() * lane_group);
    model.worker()->evaluate({0, lane_group, outputs.data()});
    for (const std::uint64_t sample : {0, 7}) {
        VirtualRun own = run;
        own.inputs.noise.clear();
        const Eigen::VectorXd deviations = drawn_inputs(run.inputs, seed, sample);
        for (std::size_t i = 0; i < run.inputs.inputs.size(); ++i) {
            const UncertainInput& input = run.inputs.inputs[i];
            Misalignment& misalignment = own.simulation.misalignment[input.line];
            (input.quantity == InputQuantity::reflector ? misalignment.reflector
                                                        : misalignment.laser)[input.component] +=
                deviations[Eigen::Index(i)];
        }
        const Measurement clean = simulate(own.machine, own.plan, own.heads, own.simulation);
        std::vector<Channel> channels = clean.channels();
        const Eigen::VectorXd readings = model.readings(sample);
        for (std::size_t c = 0; c < channels.size(); ++c)
            for (std::size_t r = 0; r < clean.size(); ++r) {
                const double noisy = readings[Eigen::Index(r * channels.size() + c)];
                expect_near(noisy, *channels[c].value[r], 8.0 * run.inputs.noise[c].distribution.spread, "noise");
                channels[c].value[r] = noisy;
            }
        const Calibration calibration = evaluate_enhanced(Measurement(clean.stations(), channels), run.plan,
                                                          run.machine.chain(), run.machine.tool(), run.calibration);
        // All samples have the weights of the nominal run (batch_evaluator.hpp).
        constexpr double share = 1e-3;  // of the standard uncertainty
        std::size_t entry = 0;
        for (const auto& f : calibration.functions)
            for (std::size_t k = 0; k < f->value.size(); ++k)
                expect_near(outputs[entry++ * lane_group + sample], f->value[k],
                            share * f->standard_uncertainty[k] + 1e-12, "calibration");
        for (const auto& s : calibration.squarenesses)
            expect_near(outputs[entry++ * lane_group + sample], s->value, share * s->standard_uncertainty,
                        "squareness");
    }
}

// Draw, trace, add noise, reduce, evaluate.
void virtual_calibrations(benchmark::State& state, Layout layout) {
    check(layout);
    const VirtualCalibrations& model = model_of(layout);
    const auto worker = model.worker();
    std::vector<double> outputs(model.outputs().size() * block);
    std::uint64_t first = 0;
    for (auto _ : state) {
        worker->evaluate({first, block, outputs.data()});
        first += block;
        benchmark::DoNotOptimize(outputs.data());
    }
    count(state, double(block));
}

// The same with the statistics of all parameters: means, standard uncertainties and both coverage intervals.
void with_statistics(benchmark::State& state, Layout layout) {
    check(layout);
    const VirtualCalibrations& model = model_of(layout);
    const Bins bins = make_bins(model, {}, {1});
    constexpr std::uint64_t leaves = 5;
    std::uint64_t first = 0;
    for (auto _ : state) {
        const PartialStatistics statistics = run_leaves(model, bins, first, leaves, {1});
        expect_near(double(statistics.samples()), double(leaves * leaf_samples), 0.0, "samples");
        first += leaves;
    }
    count(state, double(leaves * leaf_samples));
}

// --- parts ---

struct Parts {
    explicit Parts(Layout layout)
        : model(run_of(layout), seed),
          lanes(SimdSampler::make(model)),
          scratch(*lanes),
          deviations(model.run.inputs.inputs.size() * lane_group),
          readings(model.rows.size() * model.channels.size() * lane_group) {
        check(layout);
        model.draws.inputs(0, lane_group, deviations.data());
    }

    const RunModel model;
    std::unique_ptr<const SimdSampler> lanes;
    SimdSampler::Scratch scratch;
    std::vector<double> deviations, readings;
    std::uint8_t followed[lane_group];
};

void part_random_numbers(benchmark::State& state, Layout layout) {
    Parts parts(layout);
    std::vector<double> numbers((parts.model.rows.size() + 1) * lane_group);
    std::uint64_t first = 0;
    for (auto _ : state) {
        parts.model.draws.inputs(first, lane_group, parts.deviations.data());
        for (std::size_t e = 0; e < parts.model.run.inputs.noise.size(); ++e)
            for (std::size_t row = 0; row < parts.model.rows.size(); row += 32) {
                const std::size_t rows = std::min<std::size_t>(32, parts.model.rows.size() - row);
                parts.model.draws.standard_noise(e, first, lane_group, row, rows, numbers.data());
            }
        first += lane_group;
        benchmark::ClobberMemory();
    }
    count(state, double(lane_group));
}

void part_trace(benchmark::State& state, Layout layout) {
    Parts parts(layout);
    for (auto _ : state) {
        parts.lanes->trace(parts.deviations.data(), 0, parts.scratch, parts.readings.data(), parts.followed);
        benchmark::ClobberMemory();
    }
    expect_near(parts.followed[0], 1.0, 0.0, "followed");
    count(state, double(lane_group));
}

// Random numbers and their addition to the readings.
void part_noise(benchmark::State& state, Layout layout) {
    Parts parts(layout);
    parts.lanes->trace(parts.deviations.data(), 0, parts.scratch, parts.readings.data(), parts.followed);
    const std::vector<double> clean = parts.readings;
    std::uint64_t first = 0;
    for (auto _ : state) {
        parts.lanes->add_noise(first, parts.scratch, parts.readings.data());
        first += lane_group;
        benchmark::ClobberMemory();
    }
    count(state, double(lane_group));
}

// Reduction to distance and tilts, and linear map.
void part_evaluation(benchmark::State& state, Layout layout) {
    Parts parts(layout);
    parts.lanes->trace(parts.deviations.data(), 0, parts.scratch, parts.readings.data(), parts.followed);
    const BatchEvaluator& evaluator = model_of(layout).evaluator();
    BatchEvaluator::Worker worker(evaluator);
    std::vector<double> values(evaluator.entries().size() * lane_group);
    for (auto _ : state) {
        worker.evaluate(parts.readings.data(), lane_group, values.data(), lane_group);
        benchmark::ClobberMemory();
    }
    count(state, double(lane_group));
}

const bool registered = [] {
    const auto add = [](const std::string& name, void (*run)(benchmark::State&, Layout)) {
        for (const auto& [layout, value] :
             {std::pair("/one_beam", Layout::one_beam), std::pair("/layout_b", Layout::b)})
            benchmark::RegisterBenchmark((name + layout).c_str(), run, value)->MeasureProcessCPUTime();
    };
    add("virtual_calibrations", virtual_calibrations);
    add("with_statistics", with_statistics);
    add("part/random_numbers", part_random_numbers);
    add("part/trace", part_trace);
    add("part/noise", part_noise);
    add("part/evaluation", part_evaluation);
    return true;
}();

}  // namespace
