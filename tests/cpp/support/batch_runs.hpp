// Runs for tests of batches of linear evaluations.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "stepdiag/batch/batch_evaluator.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "support/usual.hpp"

namespace stepdiag {
namespace {

using Eigen::Vector3d;
using test::diagonals;
using test::lines;
using test::scale_lines;
using test::volume;
using Method = EvaluationMethod;

struct TestRun {
    std::string name;
    Plan plan;
    Heads heads;
    int repeats = 1;
    bool backward = false;
    const char* chain = "[w X' b Y Z t]";
    Vector3d tool = Vector3d::Zero();

    // The seed determines the noise; 0 means no noise.
    Measurement measure(std::uint64_t seed) const {
        SimulationOptions options;
        options.repeats = repeats, options.backward = backward;
        const bool is_of_beams = heads.head.layout == HeadLayout::multi_beam;
        if (seed > 0) options.noise = Noise{is_of_beams ? 0.02e-3 : 0.1e-3, 1e-6, 1e-3, seed};
        for (const Line& line : plan.lines()) {
            Misalignment& misalignment = options.misalignment[line.name()];
            misalignment.reflector = {150e-6, -250e-6}, misalignment.laser = {-200e-6, 100e-6};
            if (heads.head.layout == HeadLayout::psd) misalignment.psd_zero = {0.05, -0.08};
        }
        return simulate({Chain::parse(chain), make_random_error_map(volume, {}), tool}, plan, heads, options);
    }
    Calibration evaluate(const Measurement& measurement, Method method) const {
        const auto evaluation = method == Method::enhanced ? &evaluate_enhanced : &evaluate_conventional;
        return evaluation(measurement, plan, Chain::parse(chain), tool, heads.calibration(), {});
    }
    BatchEvaluator batch(const Measurement& pattern, Method method) const {
        BatchOptions options;
        options.method = method;
        return {pattern, plan, Chain::parse(chain), tool, heads.calibration(), options};
    }
};

Head spot_head(const Eigen::Vector2d& beam) {
    Head head;
    head.layout = HeadLayout::psd;
    head.psd_distance = 250.0;
    head.nominal.spot_beam = beam;
    return head;
}

Head beam_head(std::vector<Eigen::Vector2d> offsets) {
    Head head;
    head.layout = HeadLayout::multi_beam;
    head.beam_offsets = std::move(offsets);
    return head;
}

std::vector<TestRun> runs() {
    const Plan usual(volume, diagonals, 6, all_axes, scale_lines);
    const Head spots = spot_head({0.0, 0.0}), beams = beam_head({{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}});
    return {
        {"ideal", usual, {}},
        {"psd", usual, spots},
        {"three_beams", usual, beams},
        {"five_beams", usual, beam_head({{0, 0}, {20, 0}, {0, 20}, {-20, 0}, {5, -15}})},
        {"another_head_on_a_line", usual,
         Heads(spots, {{"npp",
                        [] {
                            Head head = spot_head({0.0, 0.0});
                            head.psd_distance = 320.0;
                            return head;
                        }()}})},
        {"three_diagonals", Plan(volume, lines({"ppp", "npp", "pnp"}), 5, all_axes, scale_lines), {}},
        {"reversed_lines", Plan(volume, lines({"ppn", "pnp", "nnn", "npp"}), 4, all_axes, scale_lines), spots},
        {"without_scale_lines", Plan(volume, diagonals, 4), {}},
        {"scale_lines_at_every_step", Plan(volume, diagonals, 5, all_axes, scale_lines, {}, ScalePoints::steps), spots,
         2, true},
        {"blocks", Plan(volume, diagonals, 5, all_axes, scale_lines, {}, ScalePoints::ends, 2), {}},
        {"faces",
         Plan(volume, lines({"ppp", "npp", "pnp", "nnp", "pp0", "np0", "p0p", "n0p", "0pp", "0np"}), 4, all_axes,
              scale_lines),
         beams},
        {"one_step", Plan(volume, diagonals, 1, all_axes, scale_lines), {}},
        {"orders", Plan(volume, diagonals, 4, std::vector{parse_order("XYZ"), parse_order("ZYX")}, scale_lines), spots,
         3},
        {"backward", usual, {}, 2, true},
        {"another_chain_and_tool", usual, spots, 1, false, "[w b Z X Y t]", {20.0, -30.0, 150.0}},
    };
}

std::size_t signal_count(const Measurement& run) { return run.channels().size(); }

// Arranges the sets of readings in SIMD lanes.
std::vector<double> in_lanes(const std::vector<Measurement>& sets) {
    const std::size_t channels = signal_count(sets[0]);
    std::vector<double> readings(sets[0].size() * channels * sets.size());
    for (std::size_t lane = 0; lane < sets.size(); ++lane)
        for (std::size_t row = 0; row < sets[0].size(); ++row)
            for (std::size_t c = 0; c < channels; ++c)
                readings[(row * channels + c) * sets.size() + lane] =
                    sets[lane].channels()[c].value[row].value_or(std::numeric_limits<double>::quiet_NaN());
    return readings;
}

std::vector<double> values_of(const Calibration& calibration) {
    std::vector<double> values;
    for (const auto& function : calibration.functions)
        if (function) values.insert(values.end(), function->value.begin(), function->value.end());
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) values.push_back(squareness->value);
    return values;
}

}  // namespace
}  // namespace stepdiag
