#include "stepdiag/machine/error_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector3d;
using stepdiag::Axis;
using stepdiag::Component;
using stepdiag::ErrorMap;
using stepdiag::FunctionId;
using stepdiag::FunctionTable;
using stepdiag::ParameterTable;
using stepdiag::Squareness;
using stepdiag::test::volume;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

FunctionTable nodes(std::vector<double> position, std::vector<double> value) {
    const auto size = position.size();
    return {std::move(position), std::move(value), std::vector<std::optional<double>>(size)};
}

ErrorMap with(FunctionId id, FunctionTable function) {
    ParameterTable table;
    table.functions[id.index()] = std::move(function);
    return ErrorMap(std::move(table));
}

constexpr FunctionId exx{Axis::X, Component::X};

}  // namespace

TEST(ErrorMap, FunctionIsLinearBetweenNodesAndHoldsItsEndValues) {
    const ErrorMap map = with(exx, nodes({0.0, 10.0, 40.0}, {0.0, 1.0, -2.0}));
    EXPECT_EQ(map.function(exx, -1e9), 0.0);
    EXPECT_EQ(map.function(exx, 0.0), 0.0);
    EXPECT_EQ(map.function(exx, 5.0), 0.5);
    EXPECT_EQ(map.function(exx, 10.0), 1.0);
    EXPECT_EQ(map.function(exx, 25.0), -0.5);
    EXPECT_EQ(map.function(exx, 40.0), -2.0);
    EXPECT_EQ(map.function(exx, 1e9), -2.0);
    EXPECT_EQ(map.function({Axis::Y, Component::A}, 5.0), 0.0);  // missing is 0
}

TEST(ErrorMap, OneNodeIsAConstant) { EXPECT_EQ(with(exx, nodes({3.0}, {7.0})).function(exx, 100.0), 7.0); }

TEST(ErrorMap, FunctionApproachedInTheOtherDirectionMayBeAnother) {
    const FunctionId ecx{Axis::X, Component::C}, eyx{Axis::X, Component::Y};
    ParameterTable table;
    table.functions[exx.index()] = nodes({0.0, 10.0}, {0.0, 1.0});
    table.functions[ecx.index()] = nodes({0.0, 10.0}, {0.0, 3e-5});
    table.functions[eyx.index()] = nodes({0.0, 10.0}, {0.0, 0.0});
    table.negative_functions[exx.index()] = nodes({-5.0, 5.0}, {2.0, 4.0});
    table.negative_functions[ecx.index()] = nodes({0.0}, {-1e-5});
    table.negative_functions[eyx.index()] = nodes({0.0, 800.0}, {5.0, 6.0});  // reversal breaks no frame choice
    const ErrorMap map(table);
    using stepdiag::Approach;
    EXPECT_EQ(map.function(exx, 5.0), 0.5);
    EXPECT_EQ(map.function(exx, 5.0, Approach::positive), 0.5);
    EXPECT_EQ(map.function(exx, 0.0, Approach::negative), 3.0);
    EXPECT_EQ(map.function(exx, -1e9, Approach::negative), 2.0);
    EXPECT_EQ(map.delta(Axis::X, 0.0, Approach::negative), Vector3d(3.0, 5.0, 0.0));
    EXPECT_EQ(map.theta(Axis::X, 10.0), Vector3d(0.0, 0.0, 3e-5));
    EXPECT_EQ(map.theta(Axis::X, 10.0, Approach::negative), Vector3d(0.0, 0.0, -1e-5));
    EXPECT_EQ(map.function({Axis::Y, Component::A}, 5.0, Approach::negative), 0.0);
    EXPECT_TRUE(map.frame_deviations(volume).empty());
}

TEST(ErrorMap, SquarenessesHaveNoDirection) {
    ParameterTable table;
    table.squarenesses[0] = stepdiag::SquarenessValue{1e-5, {}};
    table.functions[6] = nodes({0.0}, {0.0});  // EXY
    table.negative_functions[6] = nodes({0.0}, {1.0});
    EXPECT_EQ(ErrorMap(table).delta(Axis::Y, 600.0, stepdiag::Approach::negative).x(), 1.0 - 1e-5 * 600.0);
}

TEST(ErrorMap, SquarenessesTurnTheAxesAsTheConventionsSay) {
    ParameterTable table;
    table.squarenesses = {stepdiag::SquarenessValue{1e-5, {}}, stepdiag::SquarenessValue{2e-5, {}},
                          stepdiag::SquarenessValue{3e-5, {}}};
    const ErrorMap map(table);
    EXPECT_EQ(map.delta(Axis::X, 800.0), Vector3d(0.0, 0.0, 0.0));
    EXPECT_EQ(map.delta(Axis::Y, 600.0), Vector3d(-1e-5 * 600.0, 0.0, 0.0));
    EXPECT_EQ(map.delta(Axis::Z, 500.0), Vector3d(2e-5 * 500.0, -3e-5 * 500.0, 0.0));
    EXPECT_EQ(map.delta(Axis::Z, 5000.0), Vector3d(2e-5 * 5000.0, -3e-5 * 5000.0, 0.0));  // goes on outside the travel
    EXPECT_EQ(map.squareness(Squareness::B0Z), 2e-5);
}

TEST(ErrorMap, RandomMapObeysTheFrameChoiceAndItsAmplitudes) {
    stepdiag::RandomErrorMap options;
    options.seed = 5;
    options.translation = 0.030;
    options.rotation = 70e-6;
    options.squareness = 40e-6;
    options.intervals = 33;
    const ErrorMap map = stepdiag::make_random_error_map(volume, options);
    EXPECT_TRUE(map.frame_deviations(volume).empty());
    for (int i = 0; i < stepdiag::function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const double travel = volume[index(id.axis)];
        EXPECT_EQ(map.function(id, 0.0), 0.0) << id.name();
        if (id.is_straightness()) {
            EXPECT_EQ(map.function(id, travel), 0.0) << id.name();
        }
        double peak = 0.0;
        for (const double v : map.table().functions[i]->value) peak = std::max(peak, std::abs(v));
        const double amplitude = id.is_rotation() ? options.rotation : options.translation;
        EXPECT_NEAR(peak, amplitude, 1e-15 * amplitude) << id.name();  // a quotient and a product
        EXPECT_EQ(map.table().functions[i]->position.size(), 34u);
        EXPECT_EQ(map.table().functions[i]->position.back(), travel);
    }
    for (const Squareness s : stepdiag::all_squarenesses) EXPECT_LE(std::abs(map.squareness(s)), options.squareness);
}

TEST(ErrorMap, RandomMapScalesWithItsAmplitudesAndRepeatsWithItsSeed) {
    stepdiag::RandomErrorMap options;
    options.seed = 5;
    const ErrorMap one = stepdiag::make_random_error_map(volume, options);
    EXPECT_EQ(stepdiag::make_random_error_map(volume, options).table().functions[7]->value,
              one.table().functions[7]->value);
    options.seed = 6;
    EXPECT_NE(stepdiag::make_random_error_map(volume, options).table().functions[7]->value,
              one.table().functions[7]->value);
    options.seed = 5;
    options.translation /= 4.0;  // a power of two: the same bits, scaled
    EXPECT_EQ(stepdiag::make_random_error_map(volume, options).function(exx, 400.0), one.function(exx, 400.0) / 4.0);
}

TEST(ErrorMap, ScrewPitchRidesOnThePositioningErrors) {
    stepdiag::RandomErrorMap options;
    options.seed = 5;
    options.intervals = 400;
    const ErrorMap smooth = stepdiag::make_random_error_map(volume, options);
    options.screw_pitch = 10.0;
    options.screw_amplitude = 0.002;
    const ErrorMap screw = stepdiag::make_random_error_map(volume, options);
    // 12 mm is node 6: 1.2 turns. The sum is exact to roundings of 0.02 mm.
    EXPECT_NEAR(screw.function(exx, 12.0) - smooth.function(exx, 12.0), 0.002 * std::sin(2.4 * std::acos(-1.0)), 1e-17);
    const FunctionId eyx{Axis::X, Component::Y};
    EXPECT_EQ(screw.function(eyx, 12.0), smooth.function(eyx, 12.0));
}

TEST(ErrorMap, MapOutsideTheFrameChoiceIsUsedAsGivenAndSaid) {
    const FunctionId eyx{Axis::X, Component::Y};
    const ErrorMap map = with(eyx, nodes({0.0, 800.0}, {1e-3, 2e-3}));
    const auto deviations = map.frame_deviations(volume);
    ASSERT_EQ(deviations.size(), 2u);
    EXPECT_EQ(deviations[1].function.name(), "EYX");
    EXPECT_EQ(deviations[1].position, volume[0]);
    EXPECT_EQ(deviations[1].value, 2e-3);
    EXPECT_EQ(map.function(eyx, 0.0), 1e-3);
    expect_refused([&] { map.frame_deviations({1.0, 2.0, not_a_number}); }, "volume");
    EXPECT_EQ(with(exx, nodes({0.0, 800.0}, {0.0, 2e-3})).frame_deviations(volume).size(),
              0u);  // positioning keeps its slope
}

TEST(ErrorMap, TableThatMakesNoSenseIsRefusedByName) {
    expect_refused([] { with(exx, nodes({}, {})); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, 1.0}, {0.0})); }, "EXX");
    expect_refused([] { with(exx, {{0.0, 1.0}, {0.0, 1.0}, {std::nullopt}}); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, 0.0}, {0.0, 1.0})); }, "EXX");
    expect_refused([] { with(exx, nodes({1.0, 0.0}, {0.0, 1.0})); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, not_a_number}, {0.0, 1.0})); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, infinite}, {0.0, 1.0})); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, 1.0}, {0.0, not_a_number})); }, "EXX");
    expect_refused([] { with(exx, nodes({0.0, 1.0}, {-infinite, 0.0})); }, "EXX");
    expect_refused([] { with(exx, {{0.0, 1.0}, {0.0, 1.0}, {0.1, not_a_number}}); }, "EXX");
    expect_refused([] { with(exx, {{0.0, 1.0}, {0.0, 1.0}, {0.1, -1.0}}); }, "EXX");
    ParameterTable table;
    table.squarenesses[1] = stepdiag::SquarenessValue{not_a_number, {}};
    expect_refused([&] { ErrorMap{table}; }, "B0Z");
    ParameterTable directed;
    directed.negative_functions[0] = nodes({0.0}, {0.0});
    expect_refused([&] { ErrorMap{directed}; }, "EXX: has a table of the - direction");
    directed.functions[0] = nodes({0.0}, {0.0});
    directed.negative_functions[0] = nodes({0.0, 0.0}, {0.0, 1.0});
    expect_refused([&] { ErrorMap{directed}; }, "EXX in - direction");
}

TEST(ErrorMap, RandomMapOfNonsenseIsRefused) {
    const auto make = [](Vector3d edges, auto change) {
        stepdiag::RandomErrorMap options;
        change(options);
        stepdiag::make_random_error_map(edges, options);
    };
    const auto as_is = [](auto&) {};
    expect_refused([&] { make({0.0, 1.0, 1.0}, as_is); }, "volume");
    expect_refused([&] { make({1.0, -1.0, 1.0}, as_is); }, "volume");
    expect_refused([&] { make({1.0, 1.0, not_a_number}, as_is); }, "volume");
    expect_refused([&] { make({1.0, 1.0, infinite}, as_is); }, "volume");
    expect_refused([&] { make(volume, [](auto& o) { o.intervals = 0; }); }, "intervals");
    expect_refused([&] { make(volume, [](auto& o) { o.intervals = -5; }); }, "intervals");
    expect_refused([&] { make(volume, [](auto& o) { o.intervals = 1'000'000'000; }); }, "intervals");
    expect_refused([&] { make(volume, [](auto& o) { o.translation = -1.0; }); }, "translation");
    expect_refused([&] { make(volume, [](auto& o) { o.rotation = not_a_number; }); }, "rotation");
    expect_refused([&] { make(volume, [](auto& o) { o.squareness = infinite; }); }, "squareness");
    expect_refused([&] { make(volume, [](auto& o) { o.screw_amplitude = 1e-3; }); }, "screw_pitch");
}
