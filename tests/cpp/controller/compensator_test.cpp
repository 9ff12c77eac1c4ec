#include "stepdiag/controller/compensator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "controller/compensator_tables.hpp"
#include "stepdiag/core/rotation.hpp"
#include "support/random_machine.hpp"

namespace stepdiag {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

CompensatorOptions outside(Outside what, double margin = 0.0) {
    CompensatorOptions options;
    options.outside = what;
    options.margin = margin;
    return options;
}

TEST(Compensator, ErrorIsThatOfTheMachineInEveryChain) {
    for (const std::string& chain : all_chains()) {
        const ParameterTable table = random_table(7, chain);
        const Compensator compensator(table, "table", chain);
        for (const Position& tool : {compensator.tool(), Position{0.0, 0.0, 0.0}, Position{-100.0, 20.0, 300.0}}) {
            const Machine machine(Chain::parse(chain), ErrorMap(table), vector(tool));
            for (const Position& p : random_positions(50)) {
                const MachineError e = compensator.error(p, tool);
                EXPECT_EQ(e.status, 0u);
                EXPECT_NEAR((vector(e.position) - machine.error(vector(p))).norm(), 0.0, machine_rounding) << chain;
            }
        }
    }
}

TEST(Compensator, OrientationIsTheRotationVectorOfTheProduct) {
    for (const std::string& chain : all_chains()) {
        const ParameterTable table = random_table(7, chain);
        const Compensator compensator(table, "table", chain);
        const Machine machine(Chain::parse(chain), ErrorMap(table));
        for (const Position& p : random_positions(20)) {
            const Eigen::Vector3d vector3 = vector(compensator.error(p, compensator.tool()).orientation);
            // Matrix elements near 1 are rounded to 1e-16; the series leaves out less than that here.
            EXPECT_NEAR((rotation_exp(vector3) - machine.pose(vector(p)).rotation).norm(), 0.0, 2e-15) << chain;
        }
    }
}

TEST(Compensator, ErrorIsExactAtTheLargestAnglesThatAreTaken) {
    ParameterTable table;
    for (int i = 0; i < function_count; ++i) {
        if (!FunctionId::at(i).is_rotation()) continue;
        const double edge = test_volume[index(FunctionId::at(i).axis)];
        // 1.15e-3 in each of three components is just below 2e-3 rad.
        table.functions[i] = FunctionTable{{0.0, edge}, {1.15e-3, -1.1e-3}, {std::nullopt, std::nullopt}};
    }
    const Compensator compensator(with_header(table), "table", test_chain, {{}, {}, 0.0, 10.0});
    const Machine machine(Chain::parse(test_chain), ErrorMap(table), test_tool);
    for (const Position& p : random_positions(100)) {
        const MachineError e = compensator.error(p, position(test_tool));
        // Its series leaves out 3e-16 of levers up to 1 m.
        EXPECT_NEAR((vector(e.position) - machine.error(vector(p))).norm(), 0.0, machine_rounding);
        EXPECT_NEAR((rotation_exp(vector(e.orientation)) - machine.pose(vector(p)).rotation).norm(), 0.0, 1e-12);
    }
}

TEST(Compensator, EveryInstructionSetGivesTheSameAnswers) {
    if (!are_fused_answers_known()) GTEST_SKIP() << "this processor knows one of them";
    const Position temperature = {23.0, 27.5, 11.0};
    for (const std::string& chain : all_chains())
        for (const bool warm : {false, true}) {
            CompensatorOptions options;
            options.temperatures = {10.0, 30.0};
            const auto tables = make_tables(expanding(random_table(50, chain)), "table", chain, options);
            const Chain order = Chain::parse(chain);
            const Answers plain = answers_for(order, false, warm), fused = answers_for(order, true, warm);
            const double *tool = tables->tool.data(), *t = temperature.data();
            for (const Position& p : random_positions(50, 10.0)) {
                Position a, b, turn_a, turn_b;
                EXPECT_EQ(plain.error(*tables, p.data(), tool, t, a.data(), turn_a.data()),
                          fused.error(*tables, p.data(), tool, t, b.data(), turn_b.data()));
                EXPECT_LE(distance(a, b), 1e-15);            // sums of errors of 0.1 mm, each rounded to 1e-17 mm
                EXPECT_LE(distance(turn_a, turn_b), 1e-18);  // of 1e-4 rad
                EXPECT_EQ(plain.command(*tables, p.data(), tool, t, a.data()),
                          fused.command(*tables, p.data(), tool, t, b.data()));
                EXPECT_LE(distance(a, b), 1e-10);  // both within the bound of their forward
                EXPECT_EQ(plain.forward(*tables, a.data(), tool, t, b.data()),
                          plain.command(*tables, p.data(), tool, t, a.data()));
                EXPECT_LE(distance(b, p), 1e-10);
            }
            const std::vector<Position> many = random_positions(50, 10.0);
            std::vector<Position> a(50), b(50), turns_a(50), turns_b(50);
            plain.errors(*tables, 50, many[0].data(), tool, t, a[0].data(), turns_a[0].data(), nullptr);
            fused.errors(*tables, 50, many[0].data(), tool, t, b[0].data(), turns_b[0].data(), nullptr);
            for (std::size_t i = 0; i < 50; ++i) EXPECT_LE(distance(a[i], b[i]), 1e-15);
            for (std::size_t i = 0; i < 50; ++i) EXPECT_LE(distance(turns_a[i], turns_b[i]), 1e-18);
            plain.commands(*tables, 50, many[0].data(), tool, t, a[0].data(), nullptr);
            fused.commands(*tables, 50, many[0].data(), tool, t, b[0].data(), nullptr);
            for (std::size_t i = 0; i < 50; ++i) EXPECT_LE(distance(a[i], b[i]), 2e-10);
        }
}

// Positions in the volume and outside of it, and some that are none: in groups of four of every kind.
std::vector<Position> positions_of_every_kind() {
    std::vector<Position> positions = random_positions(200);
    for (const Position& p : random_positions(203, 20.0, 2)) positions.push_back(p);
    positions[7][1] = nan, positions[42][2] = infinity, positions[150][0] = 1e300;
    return positions;
}

TEST(Compensator, ManyAtOnceHaveTheAnswersOfEach) {
    const Position warm = {23.0, 27.5, 11.0};
    for (const std::string& chain : all_chains())
        for (const double* temperature : {static_cast<const double*>(nullptr), warm.data()}) {
            CompensatorOptions options = outside(Outside::refuse);
            options.origin = {-100.0, 30.0, 0.1};
            options.largest_correction = 0.05;  // shorter than some errors of this table
            options.temperatures = {10.0, 30.0};
            const Compensator c(expanding(random_table(50, chain)), "table", chain, options);
            std::vector<Position> asked = positions_of_every_kind();
            for (Position& p : asked)
                for (int a = 0; a < 3; ++a) p[a] += options.origin[a];
            const std::size_t n = asked.size();
            std::vector<Position> errors(n), turns(n), commands = asked;
            std::vector<unsigned> statuses(n), statuses_of_commands(n);
            const unsigned flags =
                c.errors(n, asked[0].data(), nullptr, temperature, errors[0].data(), turns[0].data(), statuses.data());
            c.commands(n, commands[0].data(), nullptr, temperature, commands[0].data(), statuses_of_commands.data());
            unsigned all = 0;
            for (std::size_t i = 0; i < n; ++i) {
                Position e, turn, command, back;
                all |= statuses[i];
                ASSERT_EQ(statuses[i], c.error(asked[i].data(), nullptr, temperature, e.data(), turn.data()));
                EXPECT_LE(distance(errors[i], e), 1e-15);    // sums of errors of 0.1 mm, each rounded to 1e-17 mm
                EXPECT_LE(distance(turns[i], turn), 1e-18);  // of 1e-4 rad
                ASSERT_EQ(statuses_of_commands[i], c.command(asked[i].data(), nullptr, temperature, command.data()));
                if (statuses_of_commands[i] & compensation_refused) continue;
                EXPECT_EQ(c.forward(commands[i].data(), nullptr, temperature, back.data()), statuses_of_commands[i]);
                EXPECT_LE(distance(back, asked[i]), c.inverse_bound());
            }
            EXPECT_EQ(flags, all);
            EXPECT_EQ(flags, compensation_outside | compensation_capped | compensation_refused);
        }
}

TEST(Compensator, ManyAtOnceMayBeFewAndWithoutStatus) {
    const Compensator c(random_table(), "table", test_chain);
    const std::vector<Position> asked = random_positions(9);
    for (std::size_t n = 0; n <= asked.size(); ++n) {
        std::vector<Position> errors(asked.size(), {7.0, 7.0, 7.0}), commands = errors;
        EXPECT_EQ(c.errors(n, asked[0].data(), nullptr, nullptr, errors[0].data(), nullptr, nullptr), 0u);
        EXPECT_EQ(c.commands(n, asked[0].data(), nullptr, nullptr, commands[0].data(), nullptr), 0u);
        for (std::size_t i = 0; i < asked.size(); ++i) {
            const auto e = c.error(asked[i], c.tool()).position, command = c.command(asked[i], c.tool()).position;
            EXPECT_LE(distance(errors[i], i < n ? e : Position{7.0, 7.0, 7.0}), 1e-15);
            EXPECT_LE(distance(commands[i], i < n ? command : Position{7.0, 7.0, 7.0}), 2e-10);  // two bounds
        }
    }
    // A tool that is too long, and temperatures that no option permits, are refused for all.
    std::vector<Position> answers(9, {7.0, 7.0, 7.0});
    std::vector<unsigned> statuses(9);
    const Position long_tool = {0.0, 0.0, 2000.0}, warm = {20.0, 20.0, 20.0};
    EXPECT_EQ(c.errors(9, asked[0].data(), long_tool.data(), nullptr, answers[0].data(), nullptr, statuses.data()),
              unsigned(compensation_refused));
    EXPECT_EQ(answers[8], (Position{0.0, 0.0, 0.0}));
    EXPECT_EQ(c.commands(9, asked[0].data(), nullptr, warm.data(), answers[0].data(), statuses.data()),
              compensation_refused | compensation_temperature);
    EXPECT_EQ(answers, asked);
    EXPECT_EQ(statuses[8], compensation_refused | compensation_temperature);
}

TEST(Compensator, NodesMayStandAnywhere) {
    ParameterTable table = random_table(50);
    // Nodes of every function at other places, some of them next to each other, some beyond the volume.
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < function_count; ++i) {
        const double edge = test_volume[index(FunctionId::at(i).axis)];
        std::vector<double> nodes = {-0.1 * edge, 0.0, edge, 1.1 * edge};
        for (int k = 0; k < 30; ++k) nodes.push_back(edge * std::pow(unit(engine), 4));
        nodes.push_back(std::nextafter(nodes.back(), edge));
        std::sort(nodes.begin(), nodes.end());
        nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
        FunctionTable moved{nodes, {}, std::vector<std::optional<double>>(nodes.size())};
        for (const double node : nodes) moved.value.push_back(1e-3 * interpolate(*table.functions[i], node));
        table.functions[i] = moved;
    }
    const Compensator compensator(table, "table", test_chain);
    const Machine machine(Chain::parse(test_chain), ErrorMap(table), test_tool);
    std::vector<Position> positions = random_positions(2000);
    for (const double node : table.functions[0]->position)  // at nodes as well
        positions.push_back({std::min(std::max(node, 0.0), test_volume.x()), 300.0, 200.0});
    for (const Position& p : positions)
        EXPECT_NEAR((vector(compensator.error(p, position(test_tool)).position) - machine.error(vector(p))).norm(), 0.0,
                    machine_rounding);
}

TEST(Compensator, ForwardOfCommandIsTheTargetForAllThatAreAnswered) {
    for (const std::string& chain : all_chains())
        for (const Outside what : {Outside::hold, Outside::linear, Outside::refuse}) {
            CompensatorOptions options = outside(what, what == Outside::linear ? 30.0 : 0.0);
            options.origin = {-400.0, 1000.0, 1.0 / 3.0};
            options.largest_correction = 0.03;  // shorter than many an error of this table
            ParameterTable table = random_table(50, chain);
            if (what == Outside::hold)  // nodes that are not equidistant
                for (auto& function : table.functions) function->position[1] *= 1.3;
            const Compensator compensator(table, "table", chain, options);
            int answered = 0, capped = 0;
            for (Position target : random_positions(500, 40.0)) {
                for (int a = 0; a < 3; ++a) target[a] += options.origin[a];
                const CompensatedPosition command = compensator.command(target, compensator.tool());
                if (command.status & compensation_refused) {
                    EXPECT_EQ(command.position, target);
                    continue;
                }
                ++answered;
                capped += (command.status & compensation_capped) != 0;
                const CompensatedPosition back = compensator.forward(command.position, compensator.tool());
                EXPECT_EQ(back.status, command.status);
                EXPECT_LE(distance(back.position, target), compensator.inverse_bound());
            }
            EXPECT_GT(answered, 100);
            EXPECT_GT(capped, 50);
        }
}

TEST(Compensator, AnInverseOverManyKinksStillMeetsItsBound) {
    // 4,000 nodes a function, each 0.3 um off its neighbours: slopes of some 1e-3, another one every 0.2 mm and less.
    ParameterTable table = random_table(4000);
    std::mt19937_64 engine(5);
    std::normal_distribution<double> noise;
    for (auto& function : table.functions)
        for (double& value : function->value)
            value += (&function - &table.functions[0]) % 6 < 3 ? 3e-4 * noise(engine) : 3e-7 * noise(engine);
    const Compensator compensator(table, "table", test_chain);
    for (const Position& target : random_positions(5000)) {
        const CompensatedPosition command = compensator.command(target, compensator.tool());
        const CompensatedPosition back = compensator.forward(command.position, compensator.tool());
        EXPECT_LE(distance(back.position, target), compensator.inverse_bound());
    }
}

TEST(Compensator, ALastStepWhoseResidualIsNotComputedMeetsItsBound) {
    // Errors near the largest that are taken: then the bound of the last step is near what it leaves.
    std::mt19937_64 engine(6);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const std::string& chain : all_chains()) {
        ParameterTable table;
        for (int i = 0; i < function_count; ++i) {
            const double edge = test_volume[index(FunctionId::at(i).axis)];
            const double size = FunctionId::at(i).is_rotation() ? 1.1e-3 : 0.5;
            table.functions[i] = FunctionTable{{0.0, 0.4 * edge, edge},
                                               {size * unit(engine), size * unit(engine), size * unit(engine)},
                                               {std::nullopt, std::nullopt, std::nullopt}};
        }
        CompensatorOptions options;
        options.largest_correction = 3.0;  // some errors are longer
        options.largest_tool = 300.0;
        const Compensator compensator(with_header(table, chain), "table", chain, options);
        for (const Position& target : random_positions(500, 5.0)) {
            const CompensatedPosition command = compensator.command(target, compensator.tool());
            const CompensatedPosition back = compensator.forward(command.position, compensator.tool());
            EXPECT_LE(distance(back.position, target), compensator.inverse_bound()) << chain;
            EXPECT_EQ(back.status, command.status);
        }
    }
}

TEST(Compensator, TheVeryEdgeDoesNotFlicker) {
    CompensatorOptions options = outside(Outside::refuse);
    options.origin = {0.1, -0.7, 1e3 / 3.0};
    const Compensator compensator(random_table(), "table", test_chain, options);
    for (int corner = 0; corner < 8; ++corner) {
        Position target;
        for (int a = 0; a < 3; ++a) target[a] = (corner >> a & 1 ? test_volume[a] : 0.0) + options.origin[a];
        const CompensatedPosition command = compensator.command(target, compensator.tool());
        EXPECT_EQ(command.status, 0u);
        const CompensatedPosition back = compensator.forward(command.position, compensator.tool());
        EXPECT_EQ(back.status, 0u);
        EXPECT_EQ(compensator.command(back.position, compensator.tool()).status, 0u);
        target[corner % 3] += corner >> corner % 3 & 1 ? 1e-5 : -1e-5;  // ten times what counts as rounding
        EXPECT_EQ(compensator.command(target, compensator.tool()).status, compensation_outside | compensation_refused);
    }
}

TEST(Compensator, OutsideTheVolumeHoldsTheErrorOfTheNearestPoint) {
    const Compensator compensator(random_table(), "table", test_chain);
    for (const Position& p : random_positions(100, 300.0)) {
        Position nearest = p;
        for (int a = 0; a < 3; ++a) nearest[a] = std::min(std::max(p[a], 0.0), test_volume[a]);
        const MachineError e = compensator.error(p, compensator.tool());
        EXPECT_EQ(e.position, compensator.error(nearest, compensator.tool()).position);
        EXPECT_EQ(e.status, nearest == p ? 0u : unsigned(compensation_outside));
    }
}

TEST(Compensator, OutsideTheVolumeLinearIsTheLastIntervalGoingOn) {
    const ParameterTable table = random_table();
    const Compensator compensator(table, "table", test_chain, outside(Outside::linear, 25.0));
    ParameterTable longer = table;  // the same with a node 25 mm further out at either end
    for (auto& function : longer.functions) {
        auto &x = function->position, &v = function->value;
        const std::size_t n = x.size();
        const double first = v[0] - 25.0 * (v[1] - v[0]) / (x[1] - x[0]);
        const double last = v[n - 1] + 25.0 * (v[n - 1] - v[n - 2]) / (x[n - 1] - x[n - 2]);
        x.insert(x.begin(), -25.0), v.insert(v.begin(), first);
        x.push_back(x.back() + 25.0), v.push_back(last);
        function->standard_uncertainty.resize(x.size());
    }
    const Machine machine(Chain::parse(test_chain), ErrorMap(longer), test_tool);
    for (const Position& p : random_positions(500, 24.9))
        EXPECT_NEAR((vector(compensator.error(p, position(test_tool)).position) - machine.error(vector(p))).norm(), 0.0,
                    machine_rounding);
    EXPECT_EQ(compensator.error({-25.1, 0.0, 0.0}, compensator.tool()).status,
              compensation_outside | compensation_refused);
}

TEST(Compensator, ALongerErrorIsCorrectedUpToTheCapAndToldWhole) {
    CompensatorOptions options;
    options.largest_correction = 0.01;
    const Compensator capped(random_table(), "table", test_chain, options), whole(random_table(), "table", test_chain);
    int count = 0;
    for (const Position& p : random_positions(200)) {
        const MachineError e = capped.error(p, capped.tool());
        EXPECT_EQ(e.position, whole.error(p, whole.tool()).position);
        const CompensatedPosition command = capped.command(p, capped.tool());
        EXPECT_LE(distance(command.position, p), 0.01 + 1e-9);
        if (!(e.status & compensation_capped)) continue;
        ++count;
        EXPECT_NEAR(distance(capped.forward(p, capped.tool()).position, p), 0.01, 1e-12);
    }
    EXPECT_GT(count, 100);
}

TEST(Compensator, OfReversalItTakesTheDirectionThatIsAskedFor) {
    ParameterTable table = random_table();
    table.negative_functions = random_table(30, test_chain, 2).functions;
    const auto error = [&](CompensatedApproach approach, const Position& p) {
        CompensatorOptions options;
        options.approach = approach;
        return vector(Compensator(table, "table", test_chain, options).error(p, position(test_tool)).position);
    };
    const Machine machine(Chain::parse(test_chain), ErrorMap(table), test_tool);
    const Approaches negative = {Approach::negative, Approach::negative, Approach::negative};
    for (const Position& p : random_positions(20)) {
        const Eigen::Vector3d plus = machine.error(vector(p)), minus = machine.error(vector(p), negative);
        EXPECT_NEAR((error(CompensatedApproach::positive, p) - plus).norm(), 0.0, machine_rounding);
        EXPECT_NEAR((error(CompensatedApproach::negative, p) - minus).norm(), 0.0, machine_rounding);
        // The mean of the tables, not of the poses: they differ in the second order, some 60 urad of 100 um.
        EXPECT_NEAR((error(CompensatedApproach::mean, p) - 0.5 * (plus + minus)).norm(), 0.0, 3e-5);
    }
}

TEST(Compensator, WhatIsNoPositionIsRefusedAndReturnedAsItCame) {
    const Compensator compensator(random_table(), "table", test_chain);
    const Position good = {1.0, 2.0, 3.0};
    for (const double bad : {nan, infinity, -infinity, 1e300, 1.1e5})
        for (int a = 0; a < 3; ++a) {
            Position p = good;
            p[a] = bad;
            for (const auto& [asked, tool] : {std::pair(p, good), std::pair(good, p)}) {
                EXPECT_EQ(compensator.error(asked, tool).status, unsigned(compensation_refused));
                EXPECT_EQ(compensator.error(asked, tool).position, (Position{0.0, 0.0, 0.0}));
                for (const CompensatedPosition& answer :
                     {compensator.command(asked, tool), compensator.forward(asked, tool)}) {
                    EXPECT_EQ(answer.status, unsigned(compensation_refused));
                    for (int b = 0; b < 3; ++b)
                        EXPECT_TRUE(answer.position[b] == asked[b] ||
                                    (std::isnan(asked[b]) && std::isnan(answer.position[b])));
                }
            }
        }
}

TEST(Compensator, WhatTheTableDoesNotTellIsSaid) {
    ParameterTable table = random_table();
    table.functions[3].reset();
    table.squarenesses[0].reset();
    table.functions[0]->position.pop_back(), table.functions[0]->value.pop_back();
    table.functions[0]->standard_uncertainty.pop_back();
    table.header["undetermined_slopes"] = "EYY EAZ";
    table.header["undetermined_reversal_constants"] = "EZZ";
    const Compensator compensator(table, "table", test_chain);
    EXPECT_EQ(compensator.uncompensated(), (std::vector<std::string>{"EXX (above 784.0 mm)", "EAX", "EYY (slope)",
                                                                     "EZZ (reversal at home)", "EAZ (slope)", "C0Y"}));
    EXPECT_TRUE(Compensator(random_table(), "table", test_chain).uncompensated().empty());
}

TEST(Compensator, ATableOfAMillionRowsIsLoadedOrRefusedWithAReason) {
    const Compensator compensator(random_table(55'555), "table", test_chain);  // 18 functions: a million nodes
    const Machine machine(Chain::parse(test_chain), ErrorMap(random_table(55'555)), test_tool);
    for (const Position& p : random_positions(50))
        EXPECT_NEAR((vector(compensator.error(p, position(test_tool)).position) - machine.error(vector(p))).norm(), 0.0,
                    machine_rounding);
}

}  // namespace
}  // namespace stepdiag
