// Runs that differ in noise and set-ups, and their evaluation in lanes.
#pragma once

#include <limits>
#include <random>
#include <string>
#include <vector>

#include "stepdiag/batch/batch_evaluator.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "support/usual.hpp"

namespace batch_tests {

using stepdiag::AdjustmentOptions;
using stepdiag::BatchEvaluator;
using stepdiag::BatchOptions;
using stepdiag::EvaluationMethod;
using stepdiag::lane_group;
using stepdiag::Line;
using stepdiag::Measurement;

// Runs that differ in noise and set-ups; the pattern has neither.
struct Workshop {
    std::vector<Line> lines = stepdiag::test::diagonals, scale_lines = stepdiag::test::scale_lines;
    stepdiag::Head head = {};
    std::string chain = "[w X' b Y Z t]";
    double angle = 1e-3;  // standard deviation of set-ups
    int repeats = 1;
    bool backward = false;
    double seconds = 0.0;
    AdjustmentOptions options = {};
    Eigen::Vector3d volume = stepdiag::test::volume, tool{20.0, -10.0, 50.0};

    stepdiag::Plan plan() const { return {volume, lines, 6, stepdiag::all_axes, scale_lines}; }
    stepdiag::Machine machine() const {
        stepdiag::RandomErrorMap errors;
        errors.intervals = 6;
        errors.seed = 3;
        return {stepdiag::Chain::parse(chain), make_random_error_map(volume, errors), tool};
    }
    stepdiag::SimulationOptions simulation() const {
        stepdiag::SimulationOptions simulation;
        simulation.repeats = repeats;
        simulation.backward = backward;
        if (seconds > 0.0) simulation.seconds_per_reading = seconds;
        return simulation;
    }
    Measurement pattern() const { return simulate(machine(), plan(), head, simulation()); }
    Measurement sample(int number) const {
        std::mt19937 generator(number);
        std::normal_distribution<double> normal(0.0, angle);
        auto simulation = this->simulation();
        simulation.noise = {1e-4, 1e-6, 1e-3, std::uint64_t(number)};
        for (const Line& line : lines) {
            auto& setup = simulation.misalignment[line.name()];
            setup.reflector = {normal(generator), normal(generator)};
            setup.laser = {normal(generator), normal(generator)};
            setup.distance_constant = 1e3 * normal(generator);
        }
        return simulate(machine(), plan(), head, simulation);
    }
    BatchEvaluator evaluator(EvaluationMethod method = EvaluationMethod::adjustment) const {
        return evaluator(pattern(), method);
    }
    BatchEvaluator evaluator(const Measurement& pattern, EvaluationMethod method) const {
        BatchOptions batch;
        batch.method = method;
        batch.adjustment = options;
        return BatchEvaluator(pattern, plan(), machine().chain(), tool, head.calibration(), batch);
    }
    stepdiag::Calibration adjust(const Measurement& run) const {
        AdjustmentOptions of_all = options;
        of_all.outlier_probability = 0.0;
        return stepdiag::adjust(run, plan(), machine().chain(), tool, head.calibration(), of_all).calibration;
    }
};

struct Value {
    double value, standard_uncertainty;
};

inline std::vector<Value> values(const stepdiag::Calibration& calibration) {
    std::vector<Value> all;
    for (const auto& function : calibration.functions)
        if (function)
            for (std::size_t k = 0; k < function->value.size(); ++k)
                all.push_back({function->value[k], function->standard_uncertainty[k]});
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) all.push_back({squareness->value, squareness->standard_uncertainty});
    return all;
}

inline std::vector<std::size_t> signals(const Measurement& run) {
    std::vector<std::size_t> list;
    for (std::size_t c = 0; c < run.channels().size(); ++c)
        if (run.channels()[c].name != "time") list.push_back(c);
    return list;
}

inline Eigen::VectorXd readings(const Measurement& run) {
    const auto channels = signals(run);
    Eigen::VectorXd all(run.size() * channels.size());
    for (std::size_t row = 0; row < run.size(); ++row)
        for (std::size_t c = 0; c < channels.size(); ++c)
            all[row * channels.size() + c] =
                run.channels()[channels[c]].value[row].value_or(std::numeric_limits<double>::quiet_NaN());
    return all;
}

// Readings and values: a row each, a column each sample.
using Lanes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Lanes evaluate(const BatchEvaluator& evaluator, const Lanes& readings) {
    Lanes values(evaluator.entries().size(), readings.cols());
    BatchEvaluator::Worker(evaluator).evaluate(readings.data(), readings.cols(), values.data(), values.cols());
    return values;
}

inline Lanes in_lanes(const std::vector<Measurement>& runs) {
    Lanes all(readings(runs.front()).size(), lane_group);
    for (std::size_t i = 0; i < lane_group; ++i) all.col(i) = readings(runs[i % runs.size()]);
    return all;
}

inline Workshop with_psd() {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::psd;
    shop.head.psd_distance = 40.0;
    shop.head.aperture = 1000.0, shop.head.mirror = {1000.0, 1000.0};  // set-ups far off lose no beam
    return shop;
}

inline Workshop with_beams() {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::multi_beam;
    shop.head.beam_offsets = {{0.0, 0.0}, {20.0, 1.0}, {-2.0, 20.0}, {-9.0, -9.0}};
    return shop;
}

}  // namespace batch_tests
