#include "stepdiag/uncertainty/virtual_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "support/refuses.hpp"
#include "support/virtual_runs.hpp"

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

// By the evaluation itself, or with the weights of the nominal run, as all samples are.
Eigen::VectorXd evaluated_alone(const VirtualRun& run, const Measurement& measurement) {
    return values_of(
        evaluate_enhanced(measurement, run.plan, run.machine.chain(), run.machine.tool(), run.calibration));
}
Eigen::VectorXd evaluated(const VirtualCalibrations& model, const Eigen::VectorXd& readings) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> lanes(readings.size(), 16);
    lanes.colwise() = readings;
    decltype(lanes) values(model.evaluator().entries().size(), 16);
    BatchEvaluator::Worker(model.evaluator()).evaluate(lanes.data(), 16, values.data(), 16);
    return values.col(0);
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
        const Eigen::VectorXd output = outputs.col(Eigen::Index(sample));
        expect_same(output, evaluated(model, readings_of(measurement)), rounding, "outputs");
        // The evaluation by itself weighs by this sample's readings: hundredths of standard uncertainties of 0.1 um
        // with gains of a per cent.
        expect_same(output, evaluated_alone(run, measurement), 2e-6, "evaluation");
    }
    EXPECT_TRUE(model.is_in_lanes());
    EXPECT_EQ(model.count().replayed, 16u);
    EXPECT_EQ(model.count().traced, 0u);
}

TEST_P(OfEveryHead, EveryQuantityInLanesIsThatOfTheScalarSampler) {
    const Kind kind = GetParam();
    VirtualRun run = run_of(kind);
    run.inputs = everything(kind);
    run.simulation.environment = Environment{Air{}};
    run.simulation.verified_share = 0.5;
    const VirtualCalibrations model(run, {}, seed);
    ASSERT_TRUE(model.is_in_lanes());
    const Eigen::MatrixXd outputs = outputs_of(model);
    EXPECT_EQ(model.count().replayed, 16u);
    EXPECT_GT(model.count().verified, 0u);
    for (std::uint64_t sample = 0; sample < 16; ++sample) {
        expect_same(outputs.col(Eigen::Index(sample)), evaluated(model, model.readings(sample)), rounding, "outputs");
    }
}

TEST_P(OfEveryHead, EachQuantityAloneChangesWhatIsReadAndIsTheSameInLanes) {
    const Kind kind = GetParam();
    const UncertainInputs all = everything(kind);
    VirtualRun run = run_of(kind);
    run.simulation.environment = Environment{Air{}};
    const Eigen::VectorXd nominal = VirtualCalibrations(run, {}, seed).readings(0);
    const auto compare = [&](const UncertainInputs& inputs, const std::string& what) {
        run.inputs = inputs;
        const VirtualCalibrations model(run, {}, seed);
        const Eigen::VectorXd readings = model.readings(3);
        // Plane-parallel glass may stand where it likes, and turn about the beam.
        const bool is_part = !inputs.inputs.empty() && !inputs.inputs[0].part.empty();
        if (!is_part) {
            EXPECT_GT((readings - nominal).cwiseAbs().maxCoeff(), 1e-10) << what;
        }
        expect_same(outputs_of(model).col(3), evaluated(model, readings), rounding, what.c_str());
    };
    for (const UncertainInput& input : all.inputs)
        if (input.part.empty() || input.component == 0) compare({{input}}, name(input));
    for (const ReadingNoise& noise : all.noise) compare({{}, {noise}}, name(noise));
}

TEST_P(OfEveryHead, SamplesAreTheSameBitsWhateverTheBlocks) {
    VirtualRun run = run_of(GetParam());
    run.inputs = everything(GetParam());
    run.simulation.environment = Environment{Air{}};
    const VirtualCalibrations model(run, {}, seed);
    const Eigen::MatrixXd together = outputs_of(model, 48);
    const auto worker = model.worker();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> one(model.outputs().size(), 16);
    for (const std::uint64_t first : {32, 0, 16}) {
        worker->evaluate({first, 16, one.data()});
        EXPECT_EQ(one, together.middleCols(Eigen::Index(first), 16)) << first;
    }
}

TEST_P(OfEveryHead, OtherInstructionSetsAgreeToRounding) {
    VirtualRun run = run_of(GetParam());
    run.inputs = everything(GetParam());
    run.simulation.environment = Environment{Air{}};
    const VirtualCalibrations model(run, {}, seed);
    const Eigen::MatrixXd fastest = outputs_of(model);
    const std::string before = instruction_set();
    for (const std::string& target : instruction_sets()) {
        choose_instruction_set(target);
        EXPECT_EQ(model.target(), target);
        const Eigen::MatrixXd found = outputs_of(model);
        choose_instruction_set(before);
        EXPECT_LE((found - fastest).cwiseAbs().maxCoeff(), rounding) << target;
    }
}

TEST_P(OfEveryHead, DeviationsOfNoneGiveTheNominalCalibration) {
    VirtualRun run = run_of(GetParam());
    run.inputs.inputs = setup_inputs(GetParam());
    run.inputs.noise = {{NoiseQuantity::common, {DistributionKind::normal, 0.0, 1e-3}}};
    const VirtualCalibrations model(run, {}, seed);
    Eigen::MatrixXd deviations = Eigen::MatrixXd::Zero(Eigen::Index(run.inputs.inputs.size()), 18);
    deviations(0, 17) = 1e-4;
    const Eigen::MatrixXd outputs = model.evaluate_at(deviations);
    expect_same(outputs.col(0), values_of(model.evaluator().of_pattern()), rounding, "nominal");
    EXPECT_EQ(outputs.col(0), outputs.col(16));
    EXPECT_NE(outputs.col(0), outputs.col(17));
    EXPECT_EQ(model.evaluate_at(deviations.rightCols(1)), outputs.col(17));
}

TEST(VirtualCalibration, SampleWithALostReadingHasNoResultAndIsTracedWhole) {
    VirtualRun run = run_of(Kind::psd_traced);
    // The spot goes by up to 2.5 m times the angle: at 0.4 mrad it is off a sensor of 2 mm.
    HeadDesign design = beam_and_psd();
    design.sensors[0].device = LateralEffect{{2.0, 2.0}};
    run.heads = make_head(design, 100.0);
    run.inputs.inputs = {normal(InputQuantity::laser, 0.2e-3, "ppp")};
    const VirtualCalibrations model(run, {}, seed);
    const Eigen::MatrixXd outputs = outputs_of(model, 64);
    int lost = 0;
    for (std::uint64_t sample = 0; sample < 64; ++sample) {
        const bool is_lost = !model.readings(sample).allFinite();
        lost += is_lost;
        EXPECT_EQ(outputs.col(Eigen::Index(sample)).hasNaN(), is_lost) << sample;
        if (is_lost) {
            EXPECT_TRUE(outputs.col(Eigen::Index(sample)).array().isNaN().all()) << sample;
        }
    }
    EXPECT_GT(lost, 0);
    EXPECT_LT(lost, 64);
    EXPECT_EQ(model.count().traced, std::uint64_t(lost));
}

TEST(VirtualCalibration, SampleThatLosesABeamOfAClosedHeadHasNoResult) {
    for (const Kind kind : {Kind::ideal, Kind::psd, Kind::multi_beam})
        for (const bool by_aperture : {false, true}) {
            VirtualRun run = run_of(kind);
            Head head = head_of(kind);
            // At 1.2 m, 5 mrad take the beam 6 mm aside on the mirror, and 12 mm on the reference plane.
            if (by_aperture) head.aperture = 12.0;
            else
                head.mirror =
                    run.plan.smallest_mirror() + Eigen::Vector2d::Constant(kind == Kind::multi_beam ? 46.0 : 6.0);
            run.heads = head;
            run.inputs.inputs = {normal(InputQuantity::laser, 2.5e-3, "npp"),
                                 normal(InputQuantity::laser, 2.5e-3, "npp", "", 1)};
            const VirtualCalibrations model(run, {}, seed);
            ASSERT_TRUE(model.is_in_lanes());
            const Eigen::MatrixXd outputs = outputs_of(model, 64);
            int lost = 0;
            for (std::uint64_t sample = 0; sample < 64; ++sample) {
                const Eigen::VectorXd readings = model.readings(sample);
                const bool is_lost = !readings.allFinite();
                lost += is_lost;
                EXPECT_EQ(outputs.col(Eigen::Index(sample)).hasNaN(), is_lost) << sample;
                if (!is_lost)
                    expect_same(outputs.col(Eigen::Index(sample)), evaluated(model, readings), rounding, "outputs");
            }
            EXPECT_GT(lost, 0) << int(kind) << by_aperture;
            EXPECT_LT(lost, 64) << int(kind) << by_aperture;
            EXPECT_GE(model.count().traced, std::uint64_t(lost));
        }
}

TEST(VirtualCalibration, FaceThatOnlyAFarSampleMeetsIsAnError) {
    // Screens beside the first beam's way back, 3.5 to 10 mm off; usual samples move it by tenths of a millimetre.
    HeadDesign design = three_beams();
    for (const double side : {-1.0, 1.0})
        design.bodies.push_back({side < 0 ? "left" : "right",
                                 make_screen(6.5, 8.0),
                                 1.0,
                                 {{side * 6.75, 0.0, 5.0}, Eigen::Matrix3d::Identity()}});
    VirtualRun run = run_of(Kind::multi_beam_traced);
    run.heads = make_head(design, 100.0);
    run.inputs.inputs = {{InputQuantity::laser, {DistributionKind::student_t, 0.0, 20e-6, 2.1}, "ppp", "", 1}};
    run.simulation.verified_share = 0.999;
    const VirtualCalibrations model(run, {}, seed);
    ASSERT_TRUE(model.is_in_lanes());
    EXPECT_NO_THROW(outputs_of(model, 64));

    std::vector<double> outputs(model.outputs().size() * 16);
    const auto worker = model.worker();
    int found = 0, thrown = 0;
    for (std::uint64_t sample = 0; sample < 200'000 && thrown == 0; ++sample) {
        const double angle = std::abs(drawn_inputs(run.inputs, seed, sample)[0]);
        if (angle < 1.5e-3 || angle > 1.9e-3) continue;  // 2 x 1.2 m of way back: 3.6 to 4.6 mm
        ++found;
        try {
            worker->evaluate({sample / 16 * 16, 16, outputs.data()});
        } catch (const ReplayMismatch&) {
            ++thrown;
        }
    }
    EXPECT_EQ(thrown, 1) << "of " << found;
}

TEST(VirtualCalibration, AirOutOfRangeIsASampleWithoutResult) {
    VirtualRun run = run_of(Kind::psd);
    run.simulation.environment = Environment{Air{}};
    run.simulation.verified_share = 0.5;
    run.inputs.inputs = {normal(InputQuantity::humidity, 0.5)};  // of 0.5: below 0 or above 1 in a third of the cases
    const VirtualCalibrations model(run, {}, seed);
    const Eigen::MatrixXd outputs = outputs_of(model, 64);
    for (std::uint64_t sample = 0; sample < 64; ++sample) {
        const double humidity = 0.5 + drawn_inputs(run.inputs, seed, sample)[0];
        EXPECT_EQ(outputs.col(Eigen::Index(sample)).hasNaN(), humidity < 0.0 || humidity > 1.0) << humidity;
    }
}

TEST(VirtualCalibration, HeadThatCannotBeReplayedIsTracedWhole) {
    VirtualRun run = run_of(Kind::psd_traced);
    run.heads = make_head(beam_and_psd(), 100.0, std::nullopt, {}, ReadingModel::coupled_mode);
    run.inputs.inputs = {normal(InputQuantity::reflector, 1e-4, "ppp")};
    const VirtualCalibrations model(run, {}, seed);
    EXPECT_FALSE(model.is_in_lanes());
    const Eigen::MatrixXd outputs = outputs_of(model);
    SimulationOptions options;
    options.misalignment["ppp"].reflector[0] = drawn_inputs(run.inputs, seed, 2)[0];
    const Measurement measurement = simulate(run.machine, run.plan, run.heads, options);
    expect_same(outputs.col(2), evaluated(model, readings_of(measurement)), rounding, "coupled");
    EXPECT_EQ(model.count().traced, 16u);
}

TEST(VirtualCalibration, DerivedOutputsAreCombinationsOfTheValues) {
    VirtualRun run = run_of(Kind::ideal);
    run.inputs.inputs = {normal(InputQuantity::reflector, 1e-4, "ppp")};
    const std::size_t entries = VirtualCalibrations(run, {}, seed).evaluator().entries().size();
    Eigen::VectorXd row = Eigen::VectorXd::Zero(Eigen::Index(entries));
    row[1] = 2.0, row[Eigen::Index(entries) - 1] = -3.0;
    const VirtualCalibrations model(run, {}, seed, {{"sum", "mm", row}});
    ASSERT_EQ(model.outputs().size(), entries + 1);
    EXPECT_EQ(model.outputs().back().name, "sum");
    const Eigen::MatrixXd outputs = outputs_of(model);
    // Two products and their sum: roundings of numbers below 1e-2.
    EXPECT_LE((outputs.bottomRows(1) - row.transpose() * outputs.topRows(Eigen::Index(entries))).norm(), 1e-15);
    expect_refused([&] { VirtualCalibrations(run, {}, seed, {{"short", "mm", row.head(3)}}); }, "short");
}

TEST(VirtualCalibration, RefusesWhatTheRunDoesNotHave) {
    const auto refused = [](Kind kind, const UncertainInput& input, const char* what) {
        VirtualRun run = run_of(kind);
        run.inputs.inputs = {input};
        expect_refused([&] { VirtualCalibrations(run, {}, seed); }, what);
    };
    refused(Kind::ideal, normal(InputQuantity::reflector, 1e-4, "pp0"), "pp0");
    refused(Kind::ideal, normal(InputQuantity::psd_zero, 1e-4, "ppp"), "psd");
    refused(Kind::psd_traced, normal(InputQuantity::psd_distance, 1.0), "design");
    refused(Kind::psd_traced, normal(InputQuantity::part_shift, 1.0, "", "prism"), "prism");
    refused(Kind::psd, normal(InputQuantity::temperature, 1.0), "state of the air");
    refused(Kind::multi_beam_traced, normal(InputQuantity::gain, 0.01, "ppp"), "gain");
    refused(Kind::multi_beam, normal(InputQuantity::beam_constant, 0.01, "ppp", "", 3), "0 to 2");
    VirtualRun run = run_of(Kind::ideal);
    run.inputs.noise = {{NoiseQuantity::channel, {DistributionKind::normal, 0.0, 1.0}, "spot_x"}};
    expect_refused([&] { VirtualCalibrations(run, {}, seed); }, "spot_x");
}
