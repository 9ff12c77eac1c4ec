#include "diagnosis/fault_tests.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>

#include "adjustment/gauss_newton.hpp"
#include "adjustment/observability.hpp"
#include "adjustment/smoothness.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/evaluation/thresholds.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "support/random_machine.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using stepdiag::AdjustmentOptions;
using stepdiag::AdjustmentProblem;
using stepdiag::FaultHypotheses;
using stepdiag::FaultHypothesis;
using stepdiag::FaultKind;
using stepdiag::FaultTests;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::micrometre;
using stepdiag::microradian;
using stepdiag::Plan;

// A run of a machine with errors, its lines a little out of true.
struct FaultWorkshop {
    int steps = 4, repeats = 1;
    std::vector<Line> lines = stepdiag::test::diagonals;
    bool backward = false;
    AdjustmentOptions options = {};

    Plan plan() const {
        return {stepdiag::test::volume, lines, steps, stepdiag::all_axes, stepdiag::test::scale_lines};
    }
    stepdiag::Machine machine() const {
        stepdiag::RandomErrorMap errors;
        errors.intervals = steps;
        errors.seed = 3;
        return {stepdiag::test::chain, make_random_error_map(stepdiag::test::volume, errors), Vector3d(20, -10, 50)};
    }
    Measurement run() const {
        stepdiag::SimulationOptions simulation;
        for (const Line& line : lines) {
            simulation.misalignment[line.name()].reflector = {200 * microradian, -100 * microradian};
            simulation.misalignment[line.name()].laser = {-150 * microradian, 250 * microradian};
        }
        simulation.noise = {0.1 * micrometre, 1 * microradian, 0.0, 5};
        simulation.repeats = repeats;
        simulation.backward = backward;
        return simulate(machine(), plan(), stepdiag::Head{}, simulation);
    }
    double square_sum(const Measurement& run) const {
        AdjustmentOptions keep = options;
        keep.outlier_probability = 0.0;
        keep.variance_components = false;
        return adjust(run, plan(), machine().chain(), Vector3d(20, -10, 50), stepdiag::Head{}.calibration(), keep)
            .weighted_square_sum;
    }
};

using NoSmoothness = std::array<double, stepdiag::function_count>;

// The adjustment of a run, and the tests at its solution. `left_out`: the reading of this row and channel is.
struct Solved {
    AdjustmentProblem problem;
    stepdiag::GaussNewton solver;
    VectorXd x;
    stepdiag::BorderedBand inverse;
    FaultHypotheses hypotheses;

    Solved(const FaultWorkshop& shop, const Measurement& run, int left_out = -1)
        : problem(with_row_left_out(shop, run, left_out)),
          solver(problem, shop.options.smoothness ? given_deviations(*shop.options.smoothness) : NoSmoothness{}),
          inverse(solver.equations().matrix()),
          hypotheses(problem) {
        stepdiag::AdjustmentTables tables(problem);
        solver.assume_usual(stepdiag::Observability(solver, tables).determined());
        x = VectorXd::Zero(problem.size());
        solver.solve(x);
        solver.refresh(x);
        solver.factor().selected_inverse(inverse);
    }
    static AdjustmentProblem with_row_left_out(const FaultWorkshop& shop, const Measurement& run, int row) {
        AdjustmentProblem problem(run, shop.plan(), shop.machine().chain(), Vector3d(20, -10, 50),
                                  stepdiag::Head{}.calibration(), shop.options);
        for (auto& reading : problem.readings())
            if (int(reading.row) == row && reading.channel == 0) reading.outlier = 1;
        return problem;
    }
    FaultTests tests() const {
        return {solver.equations(), solver.factor(), inverse, solver.equations().reading_variances(inverse),
                hypotheses};
    }

    int find(FaultKind kind, const char* line, int channel, int first) const {
        const auto& all = hypotheses.all();
        for (std::size_t h = 0; h < all.size(); ++h) {
            const auto& sequence = hypotheses.sequences()[all[h].sequence];
            const auto& setup = problem.setups()[sequence.setup];
            if (all[h].kind == kind && setup.run == 0 && setup.line == Line::parse(line) &&
                sequence.channel == channel && all[h].first == first)
                return int(h);
        }
        ADD_FAILURE() << name(kind) << " " << line << " " << channel << " " << first << " is not tested for";
        return 0;
    }
    // The largest |correlation| with any other hypothesis.
    double alike(const FaultTests& tests, int hypothesis) const {
        auto correlations = tests.correlations(hypothesis);
        correlations[hypothesis] = 0.0;
        double largest = 0.0;
        for (const double rho : correlations) largest = std::max(largest, std::abs(rho));
        return largest;
    }
};

Measurement with_fault(const Measurement& run, const Solved& solved, const FaultHypothesis& hypothesis, double size) {
    auto channels = run.channels();
    for (const int r : solved.hypotheses.readings(hypothesis)) {
        const auto& reading = solved.problem.readings()[r];
        for (auto& channel : channels)
            if (channel.name == solved.problem.channel_name(reading))
                channel.value[reading.row] =
                    *channel.value[reading.row] + size * solved.hypotheses.share(hypothesis, r);
    }
    return Measurement(run.stations(), channels);
}

// J, P and R of the whole problem, without anything that the tests use but single rows.
struct Dense {
    MatrixXd j, normal;

    explicit Dense(const Solved& solved) {
        const auto& equations = solved.solver.equations();
        const auto count = Eigen::Index(solved.problem.readings().size());
        j.setZero(count, solved.problem.size());
        for (const auto& point : solved.problem.points())
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                if (!solved.problem.readings()[r].used()) continue;
                const auto row = equations.row(point, r);
                for (int i = 0; i < row.size; ++i)
                    if (row.unknown[i] != stepdiag::no_unknown) j(r, row.unknown[i]) += row.derivative[i];
            }
        normal = j.transpose() * j;
        normal.diagonal() += equations.prior_weight() + equations.usual_weight();
        for (const auto& smooth : equations.smooth_rows()) {
            VectorXd row = VectorXd::Zero(solved.problem.size());
            for (int i = 0; i < 3; ++i)
                if (smooth.unknown[i] != stepdiag::no_unknown) row[smooth.unknown[i]] += smooth.coefficient[i];
            normal += row * row.transpose();
        }
    }
    // Of column-scaled equations: raw ones are of mm and rad.
    VectorXd solve(const VectorXd& right) const {
        const VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
        const MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
        return scale.asDiagonal() * scaled.ldlt().solve(VectorXd(scale.asDiagonal() * right));
    }
};

VectorXd indicator(const Solved& solved, const FaultHypothesis& hypothesis) {
    VectorXd c = VectorXd::Zero(Eigen::Index(solved.problem.readings().size()));
    for (const int r : solved.hypotheses.readings(hypothesis))
        if (solved.problem.readings()[r].used())
            c[r] = solved.hypotheses.share(hypothesis, r) / solved.problem.readings()[r].standard_uncertainty;
    return c;
}

void expect_as_computed_densely(const FaultWorkshop& shop, int left_out = -1) {
    const Solved solved(shop, shop.run(), left_out);
    const FaultTests tests = solved.tests();
    const Dense dense(solved);
    const auto& all = solved.hypotheses.all();
    const VectorXd& w = solved.solver.equations().residuals();
    // The square of the condition, 1e7, times rounding, of faults that are controlled by 1e-3 of themselves.
    constexpr double tolerance = 1e-6;
    // What the inverse leaves of a reading that is hardly controlled, times that condition, in the square of a slip.
    constexpr double of_inverse = 1e-10;
    std::vector<VectorXd> c, rc;
    for (std::size_t h = 0; h < all.size(); ++h) {
        c.push_back(indicator(solved, all[h]));
        const VectorXd effect = dense.solve(dense.j.transpose() * c[h]);
        rc.push_back(c[h] - dense.j * effect);
        const double q = c[h].dot(rc[h]);
        const auto& score = tests.scores()[h];
        if (q < 1e-6 * c[h].squaredNorm()) continue;
        const double near = std::max(tolerance, of_inverse * c[h].squaredNorm() / q);
        EXPECT_NEAR(score.standard_uncertainty * std::sqrt(q), 1.0, near) << h;
        EXPECT_NEAR(score.gain, std::pow(c[h].dot(w), 2) / q, near * (1.0 + score.gain)) << h;
        EXPECT_NEAR(score.size, c[h].dot(w) / q, near * score.standard_uncertainty) << h;
        if (h % 7 == 0) {
            const VectorXd own = tests.effect(int(h));
            for (int j = 0; j < own.size(); ++j)
                EXPECT_NEAR(own[j], effect[j], 1e-6 * std::abs(effect[j]) + 1e-8 * effect.lpNorm<Eigen::Infinity>());
        }
    }
    for (std::size_t h = 0; h < all.size(); h += 5) {
        const auto correlations = tests.correlations(int(h));
        for (std::size_t k = 0; k < all.size(); ++k) {
            const double q = c[h].dot(rc[h]), other = c[k].dot(rc[k]);
            if (std::min(q / c[h].squaredNorm(), other / c[k].squaredNorm()) < 1e-6) continue;
            const double near = std::max(tolerance, of_inverse * c[k].squaredNorm() / other);
            EXPECT_NEAR(correlations[k], c[k].dot(rc[h]) / std::sqrt(q * other), near) << h << " " << k;
        }
    }
}

TEST(FaultTests, AreWhatDenseMatricesSay) { expect_as_computed_densely({}); }

TEST(FaultTests, AreWhatDenseMatricesSayOfRunsBothWaysWithPriorsAndSmoothness) {
    FaultWorkshop shop;
    shop.backward = true;
    shop.options.setup[int(stepdiag::SetupQuantity::distance_constant)] = 5 * micrometre;
    shop.options.smoothness = stepdiag::Smoothness{1 * micrometre, 5 * microradian, false};
    expect_as_computed_densely(shop);
}

TEST(FaultTests, TakeNoNoteOfReadingsThatAreLeftOut) {
    const FaultWorkshop shop;
    expect_as_computed_densely(shop, 5);
    const Solved whole(shop, shop.run()), without(shop, shop.run(), 5);
    // Its own fault, and the slip from it on, which is now the next one's.
    EXPECT_EQ(without.hypotheses.all().size() + 2, whole.hypotheses.all().size());
    EXPECT_EQ(without.hypotheses.sequences().size(), whole.hypotheses.sequences().size());
}

TEST(FaultTests, HaveEachFaultOnce) {
    const FaultWorkshop shop;
    const Solved solved(shop, shop.run());
    // Four diagonals of 13 points and three channels, with constants that are free: 13 readings and 10 slips in between
    // (from the third to the last but one), and a factor on their distances. Three scale lines of two points: a fault
    // each channel.
    EXPECT_EQ(solved.hypotheses.all().size(), std::size_t(4 * (3 * (13 + 10) + 1) + 3 * 3));
    EXPECT_EQ(solved.hypotheses.sequences().size(), std::size_t(4 * 3 + 3 * 3));
    // With a constant that is known the whole channel may be off, and each end by itself.
    FaultWorkshop known = shop;
    known.options.setup[int(stepdiag::SetupQuantity::distance_constant)] = stepdiag::fixed_unknown;
    EXPECT_EQ(Solved(known, known.run()).hypotheses.all().size(),
              std::size_t(4 * (3 * 13 + 2 * 10 + 12 + 1) + 3 * (2 + 1 + 2)));
}

TEST(FaultTests, OrderReadingsByTimeThroughBothDirections) {
    FaultWorkshop shop;
    shop.backward = true;
    const Solved solved(shop, shop.run());
    for (const auto& sequence : solved.hypotheses.sequences())
        for (std::size_t i = 1; i < sequence.readings.size(); ++i)
            EXPECT_LT(solved.problem.readings()[sequence.readings[i - 1]].row,
                      solved.problem.readings()[sequence.readings[i]].row);
    EXPECT_EQ(solved.hypotheses.sequences().size(), std::size_t(4 * 3 + 3 * 3));  // a set-up serves both directions
}

// The parabola through three adjustments is what an adjustment with the fault as an unknown finds.
TEST(FaultTests, AgreeWithActualAdjustments) {
    const FaultWorkshop shop;
    const Measurement run = shop.run();
    const Solved solved(shop, run);
    for (const auto& [kind, channel, first] : {std::tuple(FaultKind::slip, 0, 6),
                                               {FaultKind::reading, 0, 4},
                                               {FaultKind::slip, 1, 5},
                                               {FaultKind::reading, 2, 9},
                                               {FaultKind::factor, 0, 0}}) {
        const auto hypothesis = solved.hypotheses.all()[solved.find(kind, "npp", channel, first)];
        const double size = kind == FaultKind::factor ? 10 * micrometre
                            : channel == 0            ? 2 * micrometre
                                                      : 20 * microradian;
        const Measurement wrong = with_fault(run, solved, hypothesis, size);
        const auto score = Solved(shop, wrong).tests().scores()[solved.find(kind, "npp", channel, first)];
        const double step = 0.5 * size;
        const auto without = [&](double f) { return shop.square_sum(with_fault(wrong, solved, hypothesis, -f)); };
        const double before = without(0.0), least = without(score.size);
        const double curvature =
            (without(score.size + step) - 2.0 * least + without(score.size - step)) / (step * step);
        // Second order: a fault of the tilts moves what the readings hardly tell (roll, lateral) by as much as set-ups
        // of 2e-4 rad turn into 1 % of its effect.
        EXPECT_NEAR(score.gain, before - least, 1e-2 * score.gain) << name(kind) << channel;
        EXPECT_NEAR(score.standard_uncertainty * std::sqrt(0.5 * curvature), 1.0, 2e-2) << name(kind) << channel;
        EXPECT_NEAR(score.size, size, 4.0 * score.standard_uncertainty) << name(kind) << channel;
        const double slope = (without(score.size + step) - without(score.size - step)) / (2.0 * step);
        EXPECT_LT(std::abs(slope / curvature), 0.01 * size + 0.01 * score.standard_uncertainty)
            << name(kind) << channel;
        EXPECT_GT(score.gain, stepdiag::thresholds.fault) << name(kind) << channel;
    }
}

TEST(FaultTests, EffectIsWhatAFaultDoesToTheSolution) {
    const FaultWorkshop shop;
    const Measurement run = shop.run();
    const Solved solved(shop, run);
    const int slip = solved.find(FaultKind::slip, "npp", 0, 6);
    constexpr double size = 1 * micrometre;
    const Solved wrong(shop, with_fault(run, solved, solved.hypotheses.all()[slip], size));
    const VectorXd change = wrong.x - solved.x, said = size * solved.tests().effect(slip);
    const VectorXd& unit = solved.solver.scale();
    // The rest is of second order.
    EXPECT_LT((change - said).cwiseProduct(unit).norm(), 2e-2 * said.cwiseProduct(unit).norm());
}

TEST(FaultTests, OfTheStandardPlanAllHaveATwinOnAnotherLine) {
    FaultWorkshop shop;
    shop.steps = 20;
    const Solved solved(shop, shop.run());
    const FaultTests tests = solved.tests();
    constexpr double first_order = 1e-4;  // set-ups of 1e-4 rad, errors of 1e-4 rad
    const auto correlation = [&](FaultKind kind, const char* line, int first, const char* other, int place) {
        return tests.correlation(solved.find(kind, line, 0, first), solved.find(kind, other, 0, place));
    };
    EXPECT_NEAR(std::abs(correlation(FaultKind::slip, "npp", 31, "ppp", 28)), 1.0, first_order);
    EXPECT_NEAR(correlation(FaultKind::reading, "ppp", 28, "nnp", 31), -1.0, first_order);
    EXPECT_NEAR(std::abs(correlation(FaultKind::reading, "p00", 1, "0p0", 1)), 1.0, first_order);
    EXPECT_NEAR(std::abs(correlation(FaultKind::reading, "0p0", 1, "00p", 1)), 1.0, first_order);
    const auto& all = solved.hypotheses.all();
    for (std::size_t h = 0; h < all.size(); ++h) {
        const bool is_distance = solved.hypotheses.sequences()[all[h].sequence].channel == 0;
        if (is_distance && tests.scores()[h].gain > 0.0) {
            EXPECT_GT(solved.alike(tests, int(h)), 1.0 - first_order) << h;
        }
    }
}

TEST(FaultTests, ThreeFaceDiagonalsOrEverythingTwiceBreakAllTwins) {
    FaultWorkshop faces, twice;
    faces.steps = twice.steps = 10;
    for (const char* face : {"pp0", "p0p", "0pp"}) faces.lines.push_back(Line::parse(face));
    twice.repeats = 2;
    for (const FaultWorkshop& shop : {faces, twice}) {
        const Solved solved(shop, shop.run());
        const FaultTests tests = solved.tests();
        for (const auto& [kind, line, first] : {std::tuple(FaultKind::slip, "npp", 16),
                                                {FaultKind::reading, "ppp", 14},
                                                {FaultKind::reading, "p00", 1},
                                                {FaultKind::reading, "00p", 1}})
            EXPECT_LT(solved.alike(tests, solved.find(kind, line, 0, first)), 0.99) << name(kind) << " " << line;
    }
}

// One way and both ways, in other orders of rows, of more set-ups than are worth a dense matrix, and of too few lines,
// where the inverse loses digits.
TEST(FaultTests, OfSlipsAreWhatSolutionsSay) {
    FaultWorkshop shop, both_ways, many, few;
    shop.steps = both_ways.steps = 20;
    few.steps = 10;
    few.lines = {Line::parse("ppp"), Line::parse("npp")};
    both_ways.backward = true;
    both_ways.options.one_setup_per_line = true;
    both_ways.repeats = 2;
    many.repeats = 12;
    const Measurement run = both_ways.run();
    std::vector<std::size_t> order(run.size());
    for (std::size_t row = 0; row < order.size(); ++row) order[row] = row * 37 % order.size();
    const auto in_order = [&](const auto& list) {
        auto reordered = list;
        for (std::size_t row = 0; row < order.size(); ++row) reordered[row] = list[order[row]];
        return reordered;
    };
    auto channels = run.channels();
    for (auto& channel : channels) channel.value = in_order(channel.value);
    const Measurement mixed(in_order(run.stations()), channels);
    for (const Solved& solved : {Solved(shop, shop.run()), Solved(both_ways, run), Solved(both_ways, mixed),
                                 Solved(many, many.run()), Solved(few, few.run())}) {
        const FaultTests tests = solved.tests();
        const auto& all = solved.hypotheses.all();
        ASSERT_GT(all.size(), std::size_t(300));
        for (int h = 0; h < int(all.size()); h += 3) {
            if (all[h].kind != FaultKind::slip) continue;
            const VectorXd effect = tests.effect(h);
            double q = tests.square(h);
            for (const int r : solved.hypotheses.readings(all[h]))
                q -= solved.solver.equations().row(r).product(effect) /
                     solved.problem.readings()[r].standard_uncertainty;
            const double found = std::pow(tests.scores()[h].standard_uncertainty, -2);
            // q is what a difference of squares leaves: of the least controlled slips 3e-7 of them.
            EXPECT_NEAR(found, q, 3e-9 * tests.square(h) + 1e-6 * q) << h;
        }
    }
}

// By the dense matrices: what the diagonals of 1 - H and (1 - H)^2 differ by, line by line.
TEST(PriorShares, AreWhatRedundanciesOweToPriors) {
    FaultWorkshop shop;
    shop.repeats = 3;
    const Solved solved(shop, shop.run());
    const Dense dense(solved);
    const VectorXd& weight = solved.solver.equations().prior_weight();
    VectorXd exact = VectorXd::Zero(dense.j.rows());
    for (int p = 0; p < solved.problem.size(); ++p)
        if (weight[p] > 0.0)
            exact += weight[p] * (dense.j * dense.solve(VectorXd::Unit(solved.problem.size(), p))).cwiseAbs2();
    const VectorXd shares = solved.solver.equations().prior_shares(solved.inverse);
    std::vector<double> of_line(solved.problem.setups().size()), exact_of_line = of_line;
    for (const auto& point : solved.problem.points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            of_line[point.setup] += shares[r];
            exact_of_line[point.setup] += exact[r];
        }
    for (std::size_t s = 0; s < of_line.size(); ++s) {
        // The rest comes from other lines' values.
        EXPECT_GT(of_line[s], 0.6 * exact_of_line[s]) << solved.problem.setups()[s].line.name();
        EXPECT_LT(of_line[s], exact_of_line[s] * (1.0 + 1e-6));
    }
    EXPECT_GT(exact.sum(), 0.1);
}

}  // namespace
