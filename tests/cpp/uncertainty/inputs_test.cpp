#include "stepdiag/uncertainty/inputs.hpp"

#include <gtest/gtest.h>

#include "support/refuses.hpp"

using namespace stepdiag;

namespace {

const Distribution standard_normal{DistributionKind::normal, 0.0, 1.0};
const Distribution rectangular{DistributionKind::rectangular, 0.0, 1.0};

UncertainInputs with(std::vector<UncertainInput> inputs) { return {std::move(inputs)}; }
UncertainInputs with(std::vector<ReadingNoise> noise) { return {{}, std::move(noise)}; }

UncertainInputs correlated(std::vector<int> members, const Eigen::MatrixXd& matrix) {
    return {{{SetupQuantity::roll, standard_normal, "ppp"},
             {SetupQuantity::gain, standard_normal, "ppp"},
             {SetupQuantity::drift, rectangular, "ppp"}},
            {},
            {{std::move(members), matrix}}};
}

Eigen::MatrixXd pair(double r) { return (Eigen::Matrix2d() << 1.0, r, r, 1.0).finished(); }

}  // namespace

TEST(UncertainInputs, NamesSayQuantityComponentAndPlace) {
    EXPECT_EQ(name(UncertainInput{SetupQuantity::reflector, standard_normal, "ppp", "", 0}), "reflector a of ppp");
    EXPECT_EQ(name(UncertainInput{SetupQuantity::psd_zero, standard_normal, "npp", "", 1}), "PSD zero y of npp");
    EXPECT_EQ(name(UncertainInput{SetupQuantity::beam_constants, standard_normal, "ppp", "", 2}),
              "beam constant d3 of ppp");
    EXPECT_EQ(name(UncertainInput{SharedQuantity::beam_offset, standard_normal, "", "", 3}), "beam offset v of d2");
    EXPECT_EQ(name(UncertainInput{SharedQuantity::part_shift, standard_normal, "", "splitter", 0}),
              "shift x of splitter");
    EXPECT_EQ(name(UncertainInput{SharedQuantity::refractive_index, standard_normal}), "refractive index");
    EXPECT_EQ(name(UncertainInput{SharedQuantity::machine_drift, standard_normal, "", "", 2}), "machine drift z");
    EXPECT_EQ(name(ReadingNoise{NoiseQuantity::channel, standard_normal, "distance"}), "noise of distance");
    EXPECT_EQ(name(ReadingNoise{NoiseQuantity::head_walk, standard_normal}), "head walk");
    EXPECT_EQ(name(ReadingNoise{NoiseQuantity::orientation, standard_normal, "", 1}), "orientation y");
}

TEST(UncertainInputs, QuantitiesAreReadBackByName) {
    for (int i = 0; i < setup_quantity_count; ++i)
        EXPECT_EQ(parse_input_quantity(name(SetupQuantity(i))), InputQuantity(SetupQuantity(i)));
    for (int i = 0; i <= int(SharedQuantity::machine_drift); ++i)
        EXPECT_EQ(parse_input_quantity(name(SharedQuantity(i))), InputQuantity(SharedQuantity(i)));
    for (int i = 0; i <= int(NoiseQuantity::orientation); ++i)
        EXPECT_EQ(parse_noise_quantity(name(NoiseQuantity(i))), NoiseQuantity(i));
    expect_refused([] { parse_input_quantity("tilt"); }, "\"tilt\"");
    expect_refused([] { parse_noise_quantity("tilt"); }, "\"tilt\"");
}

TEST(UncertainInputs, WhatAQuantityDoesNotHaveIsRefused) {
    using Inputs = std::vector<UncertainInput>;
    using Noise = std::vector<ReadingNoise>;
    expect_refused([] { check(with(Inputs{{SetupQuantity::reflector, standard_normal}})); },
                   "reflector: expected the name");
    expect_refused([] { check(with(Inputs{{SharedQuantity::pressure, standard_normal, "ppp"}})); },
                   "pressure: has no line");
    expect_refused([] { check(with(Inputs{{SharedQuantity::part_shift, standard_normal}})); }, "name of its part");
    expect_refused([] { check(with(Inputs{{SetupQuantity::laser, standard_normal, "ppp", "", 2}})); },
                   "laser, component");
    expect_refused([] { check(with(Inputs{{SetupQuantity::roll, standard_normal, "ppp", "", 1}})); },
                   "roll, component");
    expect_refused([] { check(with(Inputs{{SharedQuantity::beam_offset, standard_normal, "", "", -1}})); },
                   "0 or more");
    expect_refused([] { check(with(Noise{{NoiseQuantity::channel, standard_normal}})); }, "name of its channel");
    expect_refused([] { check(with(Noise{{NoiseQuantity::common, standard_normal, "d1"}})); }, "has no channel");
    expect_refused([] { check(with(Noise{{NoiseQuantity::position, standard_normal, "", 3}})); },
                   "position, component");
    expect_refused([] { check(with(Noise{{NoiseQuantity::head_walk, rectangular}})); }, "got rectangular");
}

TEST(UncertainInputs, GivenTwiceOrWithoutSenseIsRefusedByName) {
    const UncertainInput roll{SetupQuantity::roll, standard_normal, "ppp"};
    expect_refused([&] { check(with({roll, roll})); }, "\"roll of ppp\" is given twice");
    const ReadingNoise common{NoiseQuantity::common, standard_normal};
    expect_refused([&] { check(with({common, common})); }, "\"common noise\" is given twice");
    const Distribution negative{DistributionKind::normal, 0.0, -1.0};
    expect_refused([&] { check(with({UncertainInput{SetupQuantity::roll, negative, "ppp"}})); }, "roll of ppp, spread");
    EXPECT_NO_THROW(check(with({roll, UncertainInput{SetupQuantity::roll, standard_normal, "npp"}})));
}

TEST(UncertainInputs, CorrelationsAreOfNormalInputsAndOnceEach) {
    EXPECT_NO_THROW(check(correlated({0, 1}, pair(0.5))));
    expect_refused([] { check(correlated({0, 3}, pair(0.5))); }, "0 to 2, got 3");
    expect_refused([] { check(correlated({0, 2}, pair(0.5))); }, "\"drift of ppp\" is not normal");
    expect_refused([] { check(correlated({0, 0}, pair(0.5))); }, "\"roll of ppp\" is correlated twice");
    expect_refused([] { check(correlated({0}, pair(0.5))); }, "a row for each of 1 inputs");
    expect_refused([] { check(correlated({0, 1}, pair(1.5))); }, "positive semidefinite");
}

TEST(UncertainInputs, CorrelationFactorTimesItsTransposeIsTheCorrelation) {
    Eigen::Matrix3d regular;
    regular << 1.0, 0.9, 0.3, 0.9, 1.0, 0.1, 0.3, 0.1, 1.0;
    const Eigen::Matrix3d equal = Eigen::Matrix3d::Ones();  // three times the same number
    for (const Eigen::Matrix3d& correlation : {regular, equal}) {
        const Eigen::MatrixXd factor = correlation_factor(correlation, "c");
        EXPECT_LT((factor * factor.transpose() - correlation).cwiseAbs().maxCoeff(), 1e-15);  // rounding
    }
    Eigen::Matrix3d impossible;
    impossible << 1.0, 0.9, -0.9, 0.9, 1.0, 0.9, -0.9, 0.9, 1.0;
    expect_refused([&] { correlation_factor(impossible, "c"); }, "c: expected a positive semidefinite");
    expect_refused([&] { correlation_factor(2.0 * equal, "c"); }, "1 on the diagonal");
    expect_refused([&] { correlation_factor(equal.leftCols(2), "c"); }, "square");
    Eigen::Matrix2d skew = pair(0.5);
    skew(0, 1) = 0.4;
    expect_refused([&] { correlation_factor(skew, "c"); }, "symmetric");
}
