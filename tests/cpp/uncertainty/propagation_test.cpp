#include "stepdiag/uncertainty/propagation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "evaluation/least_squares.hpp"
#include "support/refuses.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using stepdiag::LinearModel;
using stepdiag::propagate;
using stepdiag::PropagatedInput;
using stepdiag::Propagation;

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

LinearModel one_output(double value, std::vector<PropagatedInput> inputs, const std::vector<double>& sensitivity) {
    MatrixXd c(1, Eigen::Index(sensitivity.size()));
    for (std::size_t i = 0; i < sensitivity.size(); ++i) c(0, Eigen::Index(i)) = sensitivity[i];
    return {{{"y", none, "1"}}, VectorXd::Constant(1, value), std::move(inputs), c};
}

// Three inputs, two groups.
LinearModel correlated_model() {
    LinearModel model = one_output(1.0, {{"a", "first", 3.0}, {"b", "first", 4.0}, {"c", "second", 2.0}}, {1, 1, 2});
    model.correlation = MatrixXd::Identity(3, 3);
    model.correlation(0, 1) = model.correlation(1, 0) = 0.5;
    model.correlation(1, 2) = model.correlation(2, 1) = -0.25;
    return model;
}

}  // namespace

TEST(Propagation, EndGaugeOfTheGumHasItsUncertaintyAndDegreesOfFreedom) {  // JCGM 100, H.1, table H.1; nm
    // Length of the standard, difference of lengths (repeated, random and systematic effects of the comparator), l_s
    // theta by difference of expansion coefficients and l_s alpha_s by difference of temperatures.
    const double length = 50.000623e6, alpha = 11.5e-6, mean_temperature = -0.1;
    const auto model = one_output(838.0,
                                  {{"standard", "standard", 25.0, 18.0},
                                   {"repeated", "difference", 5.8, 24.0},
                                   {"random", "difference", 3.9, 5.0},
                                   {"systematic", "difference", 6.7, 8.0},
                                   {"expansion", "temperature", 0.58e-6, 50.0},
                                   {"temperature", "temperature", 0.029, 2.0}},
                                  {1, 1, 1, 1, -length * mean_temperature, -length * alpha});
    const Propagation result = propagate(model);
    EXPECT_NEAR(result.standard_uncertainty[0], 32.0, 0.5);  // as printed: 32 nm, 16 (16.7 truncated), 93 nm
    EXPECT_NEAR(result.degrees_of_freedom[0], 16.7, 0.5);
    EXPECT_EQ(std::floor(result.degrees_of_freedom[0]), 16.0);
    EXPECT_NEAR(result.expanded(0.99)[0], 93.0, 0.5);
    ASSERT_EQ(result.groups, (std::vector<std::string>{"standard", "difference", "temperature"}));
    EXPECT_NEAR(result.budget(0, 1), 9.7, 0.05);  // u(d)
    EXPECT_NEAR(result.budget.row(0).squaredNorm(), std::pow(result.standard_uncertainty[0], 2), 1e-10);
}

TEST(Propagation, StraightLineOfTheGumComesOutOfThePseudoinverse) {  // JCGM 100, H.3: thermometer, t0 = 20
    const VectorXd t{{21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511}};
    const VectorXd b{{-.171, -.169, -.166, -.159, -.164, -.165, -.156, -.157, -.159, -.161, -.160}};
    MatrixXd a(11, 2);
    a << VectorXd::Ones(11), t.array() - 20.0;
    const MatrixXd inverse = stepdiag::solve_least_squares(a, VectorXd::Ones(11)).pseudoinverse;
    const VectorXd x = inverse * b;
    const double s = std::sqrt((a * x - b).squaredNorm() / 9.0);
    LinearModel model{{{"intercept", none, "degC"}, {"slope", none, "1"}, {"b(30)", none, "degC"}}, {}, {}, {}};
    MatrixXd outputs(3, 2);
    outputs << 1, 0, 0, 1, 1, 10;
    model.value = outputs * x;
    model.sensitivity = outputs * inverse;
    model.inputs.assign(11, {"b", "readings", s, 9.0, 0});  // one estimate s for all
    const Propagation result = propagate(model, true);
    // Half a unit of the last digit that the GUM prints.
    EXPECT_NEAR(result.value[0], -0.1712, 0.5e-4);
    EXPECT_NEAR(result.value[1], 0.00218, 0.5e-5);
    EXPECT_NEAR(result.value[2], -0.1494, 0.5e-4);
    EXPECT_NEAR(result.standard_uncertainty[0], 0.0029, 0.5e-4);
    EXPECT_NEAR(result.standard_uncertainty[1], 0.00067, 0.5e-5);
    EXPECT_NEAR(result.standard_uncertainty[2], 0.0041, 0.5e-4);
    const double correlation =
        result.covariance(0, 1) / (result.standard_uncertainty[0] * result.standard_uncertainty[1]);
    EXPECT_NEAR(correlation, -0.930, 0.5e-3);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(result.degrees_of_freedom[i], 9.0, 1e-9);  // eleven shares of one estimate
    EXPECT_NEAR(result.expanded(0.95)[2], 2.262 * result.standard_uncertainty[2], 1e-6);  // t_95(9), GUM table G.2
}

TEST(Propagation, CorrelatedResistorsAddLinearly) {  // JCGM 100, 5.2.2 example: ten resistors, one standard
    LinearModel model =
        one_output(10e3, std::vector<PropagatedInput>(10, {"resistor", "standard", 0.1}), std::vector<double>(10, 1.0));
    EXPECT_NEAR(propagate(model).standard_uncertainty[0], 0.32, 0.005);  // what the GUM calls incorrect
    model.correlation = MatrixXd::Ones(10, 10);
    EXPECT_NEAR(propagate(model).standard_uncertainty[0], 1.0, 1e-12);
}

TEST(Propagation, BudgetAndWhatIsBetweenItsGroupsMakeTheVariance) {
    const Propagation result = propagate(correlated_model(), true);
    const double first = 9 + 16 + 2 * 0.5 * 12, second = 16, between = 2 * -0.25 * 4 * 4;
    EXPECT_NEAR(result.budget(0, 0), std::sqrt(first), 1e-12);
    EXPECT_NEAR(result.budget(0, 1), std::sqrt(second), 1e-12);
    EXPECT_NEAR(result.between_groups[0], between, 1e-12);
    EXPECT_NEAR(result.covariance(0, 0), first + second + between, 1e-12);
    EXPECT_NEAR(result.standard_uncertainty[0], std::sqrt(first + second + between), 1e-12);
    EXPECT_EQ(result.degrees_of_freedom[0], infinity);
}

TEST(Propagation, CorrelatedEstimatesHaveNoEffectiveDegreesOfFreedom) {
    LinearModel model = correlated_model();
    model.inputs[0].degrees_of_freedom = 7.0;
    const Propagation result = propagate(model);
    EXPECT_TRUE(std::isnan(result.degrees_of_freedom[0]));
    EXPECT_TRUE(std::isnan(result.expanded()[0]));
    model.sensitivity(0, 0) = 0.0;  // does not contribute
    EXPECT_EQ(propagate(model).degrees_of_freedom[0], infinity);
    model = correlated_model();
    model.correlation = {};
    model.inputs[0].degrees_of_freedom = 7.0;
    EXPECT_NEAR(propagate(model).degrees_of_freedom[0], 41.0 * 41.0 / (81.0 / 7.0), 1e-10);
}

TEST(Propagation, WithoutUncertaintyThereIsNone) {
    const Propagation result = propagate(one_output(5.0, {{"a", "a", 0.0, 3.0}}, {1.0}));
    EXPECT_EQ(result.standard_uncertainty[0], 0.0);
    EXPECT_EQ(result.expanded()[0], 0.0);
}

TEST(Propagation, RefusesWhatMakesNoSense) {
    const auto refused = [](auto change, const std::string& culprit) {
        LinearModel model = correlated_model();
        change(model);
        expect_refused([&] { propagate(model); }, culprit);
    };
    refused([](LinearModel& m) { m.value = VectorXd::Zero(2); }, "value");
    refused([](LinearModel& m) { m.sensitivity = MatrixXd::Zero(1, 2); }, "sensitivity");
    refused([](LinearModel& m) { m.sensitivity(0, 1) = none; }, "sensitivity");
    refused([](LinearModel& m) { m.inputs[1].standard_uncertainty = -1.0; }, "b: ");
    refused([](LinearModel& m) { m.inputs[2].degrees_of_freedom = 0.0; }, "c: ");
    refused(
        [](LinearModel& m) {
            m.inputs[0].estimate = m.inputs[1].estimate = 0;
            m.inputs[1].degrees_of_freedom = 4.0;
        },
        "b: ");
    refused([](LinearModel& m) { m.correlation = MatrixXd::Identity(2, 2); }, "correlation: expected 3 x 3");
    refused([](LinearModel& m) { m.correlation(0, 1) = 0.4; }, "symmetric");
    refused([](LinearModel& m) { m.correlation(0, 1) = m.correlation(1, 0) = 1.2; }, "semidefinite");
    const Propagation result = propagate(correlated_model());
    expect_refused([&] { result.expanded(1.0); }, "coverage");
}
