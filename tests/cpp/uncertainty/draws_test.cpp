#include "uncertainty/draws.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "stepdiag/core/random_blocks.hpp"

namespace {

using namespace stepdiag;

constexpr std::uint64_t seed = 12;

UncertainInput input(DistributionKind kind, const std::string& line, int component = 0) {
    Distribution distribution{kind, 0.5, 2.0};
    if (kind == DistributionKind::student_t) distribution.degrees_of_freedom = 5.0;
    if (kind == DistributionKind::curvilinear_trapezoid) distribution.edge = 0.5;
    return {SetupQuantity::reflector, distribution, line, {}, component};
}

UncertainInputs all_kinds() {
    UncertainInputs inputs;
    const char* lines[] = {"ppp", "npp", "pnp", "nnp", "p00", "0p0"};
    for (int kind = 0; kind <= int(DistributionKind::curvilinear_trapezoid); ++kind) {
        inputs.inputs.push_back(input(DistributionKind(kind), lines[kind]));
        inputs.noise.push_back({NoiseQuantity::channel, inputs.inputs.back().distribution, "d" + std::to_string(kind)});
    }
    inputs.inputs.push_back(input(DistributionKind::normal, "ppp", 1));
    inputs.inputs.push_back(input(DistributionKind::normal, "npp", 1));
    inputs.correlations = {{{0, 6, 7}, Eigen::Matrix3d{{1.0, 0.6, -0.3}, {0.6, 1.0, 0.2}, {-0.3, 0.2, 1.0}}}};
    return inputs;
}

}  // namespace

TEST(Draws, InLanesAsOneByOne) {
    const Draws draws(all_kinds(), seed);
    const std::size_t inputs = draws.what().inputs.size(), rows = 7;
    std::vector<double> lanes(inputs * 2 * lane_group), noise((rows + 1) * lane_group);
    draws.inputs(32, 2 * lane_group, lanes.data());
    for (std::size_t lane = 0; lane < 2 * lane_group; ++lane) {
        const Eigen::VectorXd one = draws.inputs(32 + lane);
        for (std::size_t i = 0; i < inputs; ++i)
            // A few units in the last place of a logarithm, a sine and what the distribution makes of them.
            EXPECT_NEAR(lanes[i * 2 * lane_group + lane], one[Eigen::Index(i)], 1e-13) << i;
    }
    for (std::size_t e = 0; e < draws.what().noise.size(); ++e)
        for (const std::size_t first : {0, 8}) {
            draws.noise(e, 16, lane_group, first, rows, noise.data());
            for (std::size_t row = 0; row < rows; ++row)
                for (std::size_t lane = 0; lane < lane_group; ++lane)
                    EXPECT_NEAR(noise[row * lane_group + lane], draws.noise(e, 16 + lane, first + row), 1e-13) << e;
        }
}

TEST(Draws, NumbersDependOnTheirOwnPlaceAlone) {
    UncertainInputs few = all_kinds();
    few.inputs.resize(3);
    few.noise.resize(2);
    few.correlations.clear();
    const Draws all(all_kinds(), seed), some(few, seed);
    EXPECT_EQ(all.inputs(4).segment(1, 2), some.inputs(4).segment(1, 2));  // the first one is correlated
    EXPECT_EQ(all.noise(1, 4, 9), some.noise(1, 4, 9));
    EXPECT_NE(all.noise(0, 4, 9), all.noise(0, 5, 9));
    EXPECT_NE(all.sensor_seed(4), all.sensor_seed(5));
}

TEST(Draws, CorrelatedInputsHaveTheirCorrelation) {
    const UncertainInputs inputs = all_kinds();
    const Draws draws(inputs, seed);
    constexpr int samples = 40'000;
    Eigen::MatrixXd drawn(3, samples);
    for (int i = 0; i < samples; ++i) {
        const Eigen::VectorXd one = draws.inputs(std::uint64_t(i));
        drawn.col(i) << one[0], one[6], one[7];
    }
    drawn.array() = (drawn.array() - 0.5) / 2.0;
    // A correlation of n samples has the standard deviation (1 - r^2) / sqrt(n), 0.005; a variance sqrt(2 / n), 0.007.
    const Eigen::Matrix3d found = drawn * drawn.transpose() / samples;
    EXPECT_LE((found - inputs.correlations[0].correlation).cwiseAbs().maxCoeff(), 5.0 * 0.007);
}

TEST(Draws, FullyCorrelatedInputsAreEqual) {
    UncertainInputs inputs;
    for (const char* line : {"ppp", "npp"}) inputs.inputs.push_back(input(DistributionKind::normal, line));
    inputs.correlations = {{{0, 1}, Eigen::Matrix2d::Ones()}};
    const Draws draws(inputs, seed);
    for (std::uint64_t sample = 0; sample < 20; ++sample) {
        const Eigen::VectorXd one = draws.inputs(sample);
        EXPECT_NEAR(one[0], one[1], 1e-7);  // the root of a correlation that is singular to rounding
        EXPECT_NE(one[0], 0.5);
    }
}
