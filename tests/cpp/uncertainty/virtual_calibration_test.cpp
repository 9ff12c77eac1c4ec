#include "stepdiag/uncertainty/virtual_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "refuses.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "uncertainty/virtual_runs.hpp"

namespace {

using namespace stepdiag;
using namespace stepdiag::test;

constexpr std::uint64_t seed = 5;

// What the misalignment of a line is about, by component.
void add(Misalignment& misalignment, const UncertainInput& input, double x) {
    switch (input.quantity) {
        case InputQuantity::reflector: misalignment.reflector[input.component] += x; break;
        case InputQuantity::laser: misalignment.laser[input.component] += x; break;
        case InputQuantity::psd_zero: misalignment.psd_zero[input.component] += x; break;
        case InputQuantity::distance_constant: misalignment.distance_constant += x; break;
        case InputQuantity::beam_constant:
            misalignment.beam_constants.resize(3);
            misalignment.beam_constants[std::size_t(input.component)] += x;
            break;
        case InputQuantity::lateral: misalignment.lateral[input.component] += x; break;
        case InputQuantity::roll: misalignment.roll += x; break;
        case InputQuantity::gain: misalignment.gain += x; break;
        case InputQuantity::drift: misalignment.drift += x; break;
        default: FAIL() << "no quantity of a set-up";
    }
}

// All quantities of a set-up that a head has, on one line or another.
std::vector<UncertainInput> setup_inputs(Kind kind) {
    std::vector<UncertainInput> inputs;
    const auto pair = [&](InputQuantity quantity, double spread, const char* line) {
        for (int k = 0; k < 2; ++k) inputs.push_back(normal(quantity, spread, line, "", k));
    };
    for (const char* line : {"ppp", "npp", "nnp"}) {
        pair(InputQuantity::reflector, 200e-6, line);
        pair(InputQuantity::laser, 150e-6, line);
    }
    pair(InputQuantity::lateral, 0.2, "npp");
    inputs.push_back(normal(InputQuantity::roll, 2e-3, "npp"));
    inputs.push_back(normal(InputQuantity::distance_constant, 0.01, "pnp"));
    inputs.push_back(normal(InputQuantity::drift, 1e-6, "ppp"));
    inputs.push_back(normal(InputQuantity::drift, 1e-6, "0p0"));
    if (kind != Kind::multi_beam_traced) inputs.push_back(normal(InputQuantity::gain, 0.01, "nnp"));
    if (kind == Kind::psd || kind == Kind::psd_traced) pair(InputQuantity::psd_zero, 0.01, "pnp");
    if (kind == Kind::multi_beam || kind == Kind::multi_beam_traced)
        for (int beam = 0; beam < 3; ++beam)
            inputs.push_back(normal(InputQuantity::beam_constant, 1e-4, "pnp", "", beam));
    return inputs;
}

Eigen::VectorXd readings_of(const Measurement& run) {
    std::vector<const Channel*> channels;
    for (const Channel& channel : run.channels())
        if (channel.name != "time") channels.push_back(&channel);
    Eigen::VectorXd readings(run.size() * channels.size());
    for (std::size_t r = 0; r < run.size(); ++r)
        for (std::size_t c = 0; c < channels.size(); ++c)
            readings[Eigen::Index(r * channels.size() + c)] = channels[c]->value[r].value();
    return readings;
}

// Values of a calibration in the order of its entries.
Eigen::VectorXd values_of(const Calibration& calibration) {
    std::vector<double> values;
    for (const auto& function : calibration.functions)
        if (function) values.insert(values.end(), function->value.begin(), function->value.end());
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) values.push_back(squareness->value);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()));
}

Eigen::VectorXd evaluated(const VirtualRun& run, const Measurement& measurement) {
    return values_of(
        evaluate_enhanced(measurement, run.plan, run.machine.chain(), run.machine.tool(), run.calibration));
}

// Outputs of samples 0 ... 15, a column each.
Eigen::MatrixXd outputs_of(const VirtualCalibrations& model, std::size_t samples = 16) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> outputs(model.outputs().size(), samples);
    model.worker()->evaluate({0, samples, outputs.data()});
    return outputs;
}

// Rounding of a trace over some metres: 1e-12 mm and 1e-15 rad; sums over three steps and a volume of a metre.
constexpr double rounding = 2e-11;

void expect_same(const Eigen::VectorXd& found, const Eigen::VectorXd& expected, double tolerance, const char* what) {
    ASSERT_EQ(found.size(), expected.size()) << what;
    ASSERT_TRUE(expected.allFinite()) << what;
    EXPECT_LE((found - expected).cwiseAbs().maxCoeff(), tolerance) << what;
}

class OfEveryHead : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(VirtualCalibration, OfEveryHead, testing::ValuesIn(all_kinds));

}  // namespace

TEST_P(OfEveryHead, SampleIsASimulationWithTheDrawnSetUpsEvaluated) {
    VirtualRun run = run_of(GetParam());
    run.inputs.inputs = setup_inputs(GetParam());
    run.simulation.seconds_per_reading = 2.0;
    run.simulation.misalignment["nnp"] = {{3e-4, -2e-4}, {1e-4, 2e-4}};
    const VirtualCalibrations model(run, {}, seed);
    const Eigen::MatrixXd outputs = outputs_of(model);
    for (std::uint64_t sample = 0; sample < 16; ++sample) {
        const Eigen::VectorXd deviations = drawn_inputs(run.inputs, seed, sample);
        SimulationOptions options = run.simulation;
        for (std::size_t i = 0; i < run.inputs.inputs.size(); ++i)
            add(options.misalignment[run.inputs.inputs[i].line], run.inputs.inputs[i], deviations[Eigen::Index(i)]);
        const Measurement measurement = simulate(run.machine, run.plan, run.heads, options);
        expect_same(model.readings(sample), readings_of(measurement), rounding, "readings");
        expect_same(outputs.col(Eigen::Index(sample)), evaluated(run, measurement), rounding, "outputs");
    }
}
