// The exact adjustment as a C++ caller uses it. (The Python tests go further; these also run under the sanitizers.)
#include "stepdiag/diagnosis/adjust.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "stepdiag/adjustment/line_information.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "stepdiag/uncertainty/volume_errors.hpp"
#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector3d;
using stepdiag::Adjustment;
using stepdiag::AdjustmentOptions;
using stepdiag::FunctionId;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::SetupQuantity;

constexpr double micro = 1e-6;

// A machine, its plan and its head, every measured line misaligned by up to 1 mrad.
struct Workshop {
    int steps = 8;
    std::vector<Line> lines = stepdiag::test::diagonals, scale_lines = stepdiag::test::scale_lines;
    stepdiag::Head head = {};
    Vector3d volume = stepdiag::test::volume, tool{20.0, -10.0, 50.0};

    stepdiag::Plan plan() const { return {volume, lines, steps, stepdiag::all_axes, scale_lines}; }
    stepdiag::Machine machine() const {
        stepdiag::RandomErrorMap errors;
        errors.intervals = steps;
        errors.seed = 3;
        return {stepdiag::test::chain, make_random_error_map(volume, errors), tool};
    }
    stepdiag::SimulationOptions simulation() const {
        stepdiag::SimulationOptions options;
        double angle = 300 * micro;
        for (const Line& line : lines) {
            options.misalignment[line.name()].reflector = {angle, -0.5 * angle};
            options.misalignment[line.name()].laser = {1e-3 - angle, angle};
            options.misalignment[line.name()].distance_constant = 7.0;
            angle += 200 * micro;
        }
        return options;
    }
    Measurement run() const { return simulate(machine(), plan(), head, simulation()); }
    Adjustment adjust(const Measurement& run, const AdjustmentOptions& options = {}) const {
        return stepdiag::adjust(run, plan(), machine().chain(), tool, head.calibration(), options);
    }
};

struct Worst {
    double position = 0.0, angle = 0.0;
};

Worst worst(const stepdiag::Calibration& calibration, const stepdiag::ErrorMap& truth) {
    Worst worst;
    for (int i = 0; i < stepdiag::function_count; ++i) {
        if (!calibration.functions[i] || !calibration.functions[i]->slope_determined) continue;
        const auto& function = *calibration.functions[i];
        double& largest = FunctionId::at(i).is_rotation() ? worst.angle : worst.position;
        for (std::size_t k = 0; k < function.position.size(); ++k)
            largest = std::max(largest,
                               std::abs(function.value[k] - truth.function(FunctionId::at(i), function.position[k])));
    }
    for (const auto s : stepdiag::all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)])
            worst.angle = std::max(worst.angle, std::abs(entry->value - truth.squareness(s)));
    return worst;
}

Measurement changed(const Measurement& run, const char* channel, std::size_t row, double change) {
    auto channels = run.channels();
    for (auto& c : channels)
        if (c.name == channel) c.value[row] = *c.value[row] + change;
    return Measurement(run.stations(), channels);
}

// The floor of double precision: a metre rounded to 1e-13 mm, and a few steps' sum of it.
constexpr double floor_mm = 2e-11, floor_rad = 1e-13;

TEST(Adjustment, FindsMachineAndSetUpToTheFloorOfDoublePrecision) {
    const Workshop shop;
    const Adjustment result = shop.adjust(shop.run());
    const Worst error = worst(result.calibration, shop.machine().errors());
    EXPECT_LE(error.position, floor_mm);
    EXPECT_LE(error.angle, floor_rad);
    EXPECT_LE(result.iterations, 6);
    EXPECT_TRUE(result.calibration.findings.empty());
    EXPECT_EQ(result.calibration.method, "adjustment");
    const auto truth = shop.simulation().misalignment;
    for (const auto& estimate : result.setup) {
        const auto entry = truth.find(estimate.line);
        if (entry == truth.end()) continue;
        if (estimate.quantity == SetupQuantity::reflector) {
            EXPECT_NEAR(*estimate.value, entry->second.reflector[estimate.component], floor_rad);
        } else if (estimate.quantity == SetupQuantity::laser) {
            EXPECT_NEAR(*estimate.value, entry->second.laser[estimate.component], floor_rad);
        } else if (estimate.quantity == SetupQuantity::distance_constant) {
            EXPECT_NEAR(*estimate.value, 7.0, floor_mm);
        }
    }
}

TEST(Adjustment, FindsTheZeroOfAPositionSensingDevice) {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::psd;
    shop.head.psd_distance = 40.0;
    auto options = shop.simulation();
    for (const Line& line : shop.lines) options.misalignment[line.name()].psd_zero = {1.5, 2.0};
    const auto result = shop.adjust(simulate(shop.machine(), shop.plan(), shop.head, options));
    EXPECT_LE(worst(result.calibration, shop.machine().errors()).position, floor_mm);
    EXPECT_LE(worst(result.calibration, shop.machine().errors()).angle, floor_rad);
}

TEST(Adjustment, SaysWhatWithoutScaleLinesStaysOpenAndKeepsTheShapes) {
    Workshop shop;
    shop.scale_lines.clear();
    const Adjustment result = shop.adjust(shop.run());
    for (const auto& scale : {std::pair("EXX", "p00"), std::pair("EYY", "0p0"), std::pair("EZZ", "00p")}) {
        const auto& findings = result.calibration.findings;
        EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [&](const stepdiag::Undetermined& finding) {
            return finding.part == stepdiag::OpenPart::slope &&
                   finding.parameters == std::vector<std::string>{scale.first} &&
                   finding.remedies == std::vector{stepdiag::Remedy::axis_line} && finding.line == scale.second;
        })) << scale.first;
    }
    EXPECT_FALSE(result.calibration.functions[0]->slope_determined);
    EXPECT_TRUE(result.calibration.squarenesses[0]);
    // The scales are not known one by one, but along the diagonal they are.
    ASSERT_FALSE(result.combinations.empty());
    const stepdiag::KnownCombination& mean = result.combinations.back();
    ASSERT_EQ(mean.terms.size(), 3U);
    double known = 0.0;
    for (const auto& [weight, parameter] : mean.terms) {
        const auto id = *stepdiag::FunctionId::parse(parameter);
        const double edge = shop.plan().volume()[stepdiag::index(id.axis)];
        known += weight * shop.machine().errors().function(id, edge) / edge;
    }
    // Open slopes leave products of angles: 300 urad x 60 urad and a few of them.
    EXPECT_NEAR(mean.value, known, 1e-7);
    EXPECT_LE(worst(result.calibration, shop.machine().errors()).angle, 1e-7);
}

TEST(Adjustment, FindsAndNamesReadingsThatDoNotFit) {
    Workshop shop;
    auto options = shop.simulation();
    options.noise = {0.1e-3, 1e-6, 0.0, 5};
    const Measurement run = simulate(shop.machine(), shop.plan(), shop.head, options);
    const Measurement spoilt = changed(changed(run, "distance", 30, 20e-3), "beta", 61, -60e-6);
    const Adjustment result = shop.adjust(spoilt);
    const auto is_left_out = [&](std::size_t row, const char* channel) {
        return std::any_of(result.residuals.begin(), result.residuals.end(), [&](const auto& residual) {
            return residual.row == row && residual.channel == channel && !residual.used();
        });
    };
    EXPECT_TRUE(is_left_out(30, "distance"));
    EXPECT_TRUE(is_left_out(61, "beta"));
    ASSERT_EQ(result.faults.size(), 2u);
    for (const stepdiag::FaultClass& found : result.faults) {
        EXPECT_EQ(found.treatment, stepdiag::FaultTreatment::left_out);
        // The distance of the same point on another line fits as badly.
        EXPECT_EQ(found.members.size(), found.members.front().channel == "distance" ? 2u : 1u);
    }
    // Without both distances of its step nothing knows the machine there.
    EXPECT_EQ(result.verdict.fit, stepdiag::Fit::doubtful);
    EXPECT_EQ(result.verdict.reasons.front().finding, stepdiag::FitFinding::undetermined);
    EXPECT_GT(result.chi_square_probability, 1e-3);
    AdjustmentOptions keep;
    keep.outlier_probability = 0.0;
    keep.variance_components = false;
    EXPECT_LT(shop.adjust(spoilt, keep).chi_square_probability, 1e-6);
}

TEST(Adjustment, WeighsAChannelThatScattersMoreThanStated) {
    Workshop shop;
    auto options = shop.simulation();
    options.noise = {2.0e-3, 1e-6, 0.0, 5};
    const Adjustment result = shop.adjust(simulate(shop.machine(), shop.plan(), shop.head, options));
    EXPECT_EQ(result.verdict.fit, stepdiag::Fit::rejected);
    ASSERT_EQ(result.verdict.reasons.size(), 1u);
    EXPECT_EQ(result.verdict.reasons.front().finding, stepdiag::FitFinding::noise_factor);
    EXPECT_EQ(result.calibration.fit_codes, std::vector<std::string>{"noise_factor"});
    const auto judged = stepdiag::judge(result, {"a shifted row", {"air of 80 °C"}});
    EXPECT_EQ(judged.calibration.fit_codes, (std::vector<std::string>{"mistake", "noise_factor", "implausible_input"}));
    EXPECT_TRUE(result.faults.empty());
    for (const stepdiag::VarianceComponent& each : result.variance_components) {
        const double simulated = each.noise.channel == "distance" ? 20.0 : 1.0;  // of 0.1 um
        EXPECT_EQ(each.used, simulated > 1.0) << each.noise.channel;
        EXPECT_NEAR(each.noise.factor, simulated, 3.0 * each.standard_uncertainty) << each.noise.channel;
    }
}

TEST(Adjustment, IsJudgedWithWhatWasFoundBesideIt) {
    const Workshop shop;
    const Adjustment sound = shop.adjust(shop.run());
    EXPECT_EQ(judge(sound, {}).verdict.fit, sound.verdict.fit);
    const Adjustment doubtful = judge(sound, {"", {"85 °C", "an expansion of -11.5"}});
    EXPECT_EQ(doubtful.verdict.fit, stepdiag::Fit::doubtful);
    EXPECT_EQ(doubtful.calibration.fit, stepdiag::Fit::doubtful);
    ASSERT_GE(doubtful.verdict.reasons.size(), 2u);
    EXPECT_EQ(doubtful.verdict.reasons[0].parameter, "85 °C");
    EXPECT_EQ(doubtful.verdict.reasons[1].parameter, "an expansion of -11.5");
    const Adjustment rejected = judge(doubtful, {"line ppp is line npp", {}});
    EXPECT_EQ(rejected.calibration.fit, stepdiag::Fit::rejected);
    EXPECT_EQ(rejected.verdict.reasons.front().finding, stepdiag::FitFinding::mistake);
    // What makes a fit doubtful does not mend a rejected one, and comes last.
    const Adjustment both = judge(rejected, {"", {"68 °F"}});
    EXPECT_EQ(both.verdict.fit, stepdiag::Fit::rejected);
    EXPECT_EQ(both.verdict.reasons.back().parameter, "68 °F");
}

TEST(Adjustment, CovarianceHasTheVariancesOfTheTables) {
    const Workshop shop;
    AdjustmentOptions options;
    options.full_covariance = true;
    const auto calibration = shop.adjust(shop.run(), options).calibration;
    Eigen::Index i = 0;
    for (const auto& function : calibration.functions)
        for (const double u : function->standard_uncertainty) {
            EXPECT_NEAR(std::sqrt(calibration.covariance(i, i)), u, 1e-15 * u);  // roundings of one product
            ++i;
        }
    for (const auto& squareness : calibration.squarenesses) {
        EXPECT_NEAR(std::sqrt(calibration.covariance(i, i)), squareness->standard_uncertainty,
                    1e-15 * squareness->standard_uncertainty);
        ++i;
    }
    EXPECT_EQ(i, calibration.covariance.rows());
}

TEST(Adjustment, TellsReversalWhereRunsGoBothWays) {
    const Workshop shop;
    auto options = shop.simulation();
    options.backward = true;
    stepdiag::ParameterTable table = shop.machine().errors().table();
    auto& exx = *table.functions[FunctionId::parse("EXX")->index()];
    auto negative = exx;
    for (double& value : negative.value) value += 3e-3;
    table.negative_functions[FunctionId::parse("EXX")->index()] = negative;
    const stepdiag::Machine machine(shop.machine().chain(), stepdiag::ErrorMap(table), shop.tool);
    const auto result = shop.adjust(simulate(machine, shop.plan(), shop.head, options));
    const auto& reversal = result.calibration.reversal[FunctionId::parse("EXX")->index()];
    ASSERT_TRUE(reversal);
    EXPECT_TRUE(reversal->constant_determined);
    // Reversals of straightness are open at home: micrometres of them, times angles of 1 mrad.
    constexpr double second_order = 1e-5;  // mm
    for (const double value : reversal->value) EXPECT_NEAR(value, -3e-3, second_order);
    EXPECT_LE(worst(result.calibration, shop.machine().errors()).position, second_order);
}

TEST(Adjustment, RefusesWhatMakesNoSense) {
    const Workshop shop;
    const Measurement run = shop.run();
    const auto refused = [&](const AdjustmentOptions& options, const char* culprit) {
        expect_refused([&] { shop.adjust(run, options); }, culprit);
    };
    AdjustmentOptions options;
    options.outlier_probability = 0.9;
    refused(options, "outlier_probability");
    options = {};
    options.setup[static_cast<int>(SetupQuantity::drift)] = stepdiag::free_unknown;
    refused(options, "time");
    options = {};
    options.setup[static_cast<int>(SetupQuantity::roll)] = -1.0;
    refused(options, "roll");
    options = {};
    options.setup_by_line["pp0"] = {};
    refused(options, "pp0");
    options = {};
    options.setup_by_line["p00"][static_cast<int>(SetupQuantity::laser)] = stepdiag::free_unknown;
    refused(options, "laser of p00");
    options = {};
    options.smoothness = stepdiag::Smoothness{-1.0, 0.0, false};
    refused(options, "smoothness");
}

// The square sum is a narrow bent valley there: a laser's angle acts on distances by its square.
TEST(Adjustment, BeamsWithLasersFromTheirPriorsAndSeveralRunsConvergeFromZero) {
    Workshop shop;
    shop.head.layout = stepdiag::HeadLayout::multi_beam;
    shop.head.beam_offsets = {{50.0, 0.0}, {-25.0, 43.3}, {-25.0, -43.3}};
    shop.head.aperture = 1000.0, shop.head.mirror = {1000.0, 1000.0};
    AdjustmentOptions options;
    options.uncertainty.distance = 1e-4;
    options.outlier_probability = 0.0;
    for (int seed = 1; seed <= 12; ++seed) {
        std::mt19937 generator(seed);
        std::normal_distribution<double> normal;
        stepdiag::SimulationOptions simulation;
        simulation.noise = {1e-4, 0.0, 0.0, std::uint64_t(seed)};
        simulation.repeats = 1 + seed % 3;
        for (const Line& line : shop.lines) {
            auto& setup = simulation.misalignment[line.name()];
            if (seed % 2 == 0) {
                setup.reflector = {100 * micro, -100 * micro};
                continue;
            }
            setup.reflector = {2e-3 * normal(generator), 2e-3 * normal(generator)};
            setup.laser = {2e-3 * normal(generator), 2e-3 * normal(generator)};
            setup.distance_constant = normal(generator);
        }
        const Measurement run = simulate(shop.machine(), shop.plan(), shop.head, simulation);
        const Adjustment found = shop.adjust(run, options);
        // One sound run in a million has more.
        EXPECT_GT(found.chi_square_probability, 1e-6) << seed;
    }
}

// What lines tell one by one, against the adjustment of a run of just these lines: to 2 %, because set-ups are taken to
// be where is usual for them, and the machine where all lines say; 1.2 % was found where much is open.
void expect_same_knowledge(const Workshop& all, const std::vector<Line>& lines, const std::vector<Line>& scale_lines) {
    const auto run_of = [&](const std::vector<Line>& own, const std::vector<Line>& own_scales) {
        Workshop some = all;
        some.lines = own;
        some.scale_lines = own_scales;
        stepdiag::SimulationOptions as_set_up;
        for (const auto& [line, set_up] : all.simulation().misalignment)
            if (some.plan().contains(Line::parse(line))) as_set_up.misalignment[line] = set_up;
        return std::pair(some, simulate(some.machine(), some.plan(), some.head, as_set_up));
    };
    constexpr int grid = 3;
    const auto [measured, run] = run_of(all.lines, {});
    stepdiag::LineInformation information(run, measured.plan(), measured.machine().chain(), all.tool,
                                          all.head.calibration(), {}, grid);
    const auto [scales, scale_run] = run_of({all.lines.front()}, all.scale_lines);
    information.add(scale_run, scales.plan(), all.head.calibration(), {});
    std::vector<stepdiag::ChosenLine> chosen;
    for (const Line& line : lines) chosen.push_back({line.name(), false});
    for (const Line& line : scale_lines) chosen.push_back({line.name(), true});
    const stepdiag::KnownByLines known = information.known_by(chosen);

    const auto [some, some_run] = run_of(lines, scale_lines);
    AdjustmentOptions options;
    options.full_covariance = true;
    const stepdiag::Calibration calibration = some.adjust(some_run, options).calibration;
    for (int i = 0; i < stepdiag::function_count; ++i) {
        const auto& function = calibration.functions[i];
        const bool whole = function && function->slope_determined && int(function->position.size()) == all.steps + 1;
        EXPECT_EQ(known.whole[i], whole) << FunctionId::at(i).name();
        ASSERT_EQ(std::isnan(known.largest[i]), !function.has_value()) << FunctionId::at(i).name();
        if (!function) continue;
        const double u =
            *std::max_element(function->standard_uncertainty.begin(), function->standard_uncertainty.end());
        EXPECT_NEAR(known.largest[i], u, 0.02 * u) << FunctionId::at(i).name();
    }
    stepdiag::PointRows points(grid * grid * grid, 3);
    for (int i = 0; i < points.rows(); ++i)
        points.row(i) = all.volume.cwiseProduct(Vector3d(i / 9, i / 3 % 3, i % 3)) / (grid - 1);
    const auto u = error_uncertainties_at(calibration, all.tool, points);
    for (int i = 1; i < points.rows(); ++i) {  // home has no error
        const double variance = u.row(i).head<3>().squaredNorm();
        EXPECT_TRUE(std::isnan(variance) || !std::isnan(known.volume[i])) << points.row(i);
        if (std::isnan(variance)) continue;  // also where nothing that is open acts, as next to home
        EXPECT_NEAR(known.volume[i], variance, 0.02 * variance) << points.row(i);
    }
}

Workshop with_all_lines() {
    Workshop all;
    all.steps = 4;
    for (const char* name : {"pp0", "np0", "p0p", "n0p", "0pp", "0np", "p00"}) all.lines.push_back(Line::parse(name));
    return all;
}

TEST(LineInformation, OfAllLinesIsWhatTheAdjustmentKnows) {
    const Workshop all = with_all_lines();
    std::vector<Line> lines = all.lines;
    lines.pop_back();  // a plan measures an axis once
    expect_same_knowledge(all, lines, all.scale_lines);
}

TEST(LineInformation, OfFourDiagonalsAndTwoScaleLines) {
    expect_same_knowledge(with_all_lines(), stepdiag::test::diagonals, {Line::parse("p00"), Line::parse("00p")});
}

TEST(LineInformation, OfTooFewLinesLeavesOpenWhatTheAdjustmentDoes) {
    expect_same_knowledge(with_all_lines(), {Line::parse("ppp"), Line::parse("p0p")}, {Line::parse("p00")});
    expect_same_knowledge(with_all_lines(), {Line::parse("pp0"), Line::parse("p00")}, {});
}

TEST(LineInformation, RefusesWhatItCannotTell) {
    const Workshop all;
    stepdiag::LineInformation information(all.run(), all.plan(), all.machine().chain(), all.tool,
                                          all.head.calibration(), {}, 2);
    expect_refused([&] { information.known_by({{"pp0", false}}); }, "no run has the line \"pp0\"");
    Workshop finer = all;
    finer.steps = 10;
    expect_refused([&] { information.add(finer.run(), finer.plan(), all.head.calibration(), {}); },
                   "expected 8 steps, got 10");
    AdjustmentOptions smooth;
    smooth.smoothness = stepdiag::Smoothness{1.0, 1.0};
    expect_refused(
        [&] {
            stepdiag::LineInformation(all.run(), all.plan(), all.machine().chain(), all.tool, all.head.calibration(),
                                      smooth, 2);
        },
        "got expansion coefficients, drifts, smoothness");
}

}  // namespace
