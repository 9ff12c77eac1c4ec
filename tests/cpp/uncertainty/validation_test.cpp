#include "stepdiag/uncertainty/validation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "stepdiag/monte_carlo/function_model.hpp"
#include "support/refuses.hpp"

namespace {

using namespace stepdiag;
using Eigen::MatrixXd;
using Eigen::VectorXd;

using Function = std::function<double(const VectorXd&)>;

// Propagation of one output by central differences, as of virtual calibrations.
Propagation propagated(const Function& f, const std::vector<Distribution>& distributions, const std::string& unit) {
    const Eigen::Index n = Eigen::Index(distributions.size());
    VectorXd at(n);
    for (Eigen::Index i = 0; i < n; ++i) at[i] = distributions[std::size_t(i)].expectation;
    LinearModel model{{{"y", std::nan(""), unit}}, VectorXd::Constant(1, f(at)), {}, MatrixXd(1, n)};
    MatrixXd second(1, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Distribution& d = distributions[std::size_t(i)];
        const bool is_t = d.kind == DistributionKind::student_t;
        const double u = is_t ? d.spread : d.standard_uncertainty();
        VectorXd up = at, down = at;
        up[i] += u;
        down[i] -= u;
        model.sensitivity(0, i) = (f(up) - f(down)) / (2.0 * u);
        second(0, i) = (f(up) + f(down) - 2.0 * f(at)) / 2.0;
        model.inputs.push_back({"x" + std::to_string(i), "x", u, d.degrees_of_freedom, -1, d.kind});
    }
    Propagation result = propagate(model);
    result.second_order = second;
    return result;
}

MonteCarloResult drawn(const Function& f, const std::vector<Distribution>& distributions, const std::string& unit,
                       std::uint64_t samples = 400'000) {
    const FunctionModel::Function function = [f](const FunctionModel::Values& inputs, auto outputs) {
        for (Eigen::Index s = 0; s < inputs.cols(); ++s) outputs(0, s) = f(inputs.col(s).matrix());
    };
    const FunctionModel model(function, distributions, {{"y", std::nan(""), unit}}, 1);
    return monte_carlo(model, {}, samples);
}

Validation compared(const Function& f, const std::vector<Distribution>& distributions, const std::string& unit = "1",
                    std::uint64_t samples = 400'000, int digits = 2) {
    return compare(propagated(f, distributions, unit), drawn(f, distributions, unit, samples), digits);
}

Distribution gaussian(double mean, double u) { return {DistributionKind::normal, mean, u}; }

void expect_reason(const Validation& validation, const std::vector<std::string>& words) {
    EXPECT_FALSE(validation.validated[0]);
    EXPECT_EQ(validation.failures(), 1u);
    for (const std::string& word : words)
        EXPECT_NE(validation.reason[0].find(word), std::string::npos) << validation.reason[0] << " lacks " << word;
}

}  // namespace

TEST(Validation, SumOfFourNormalsIsValidated) {  // JCGM 101, 9.2.2
    const Validation v = compared([](const VectorXd& x) { return x.sum(); }, std::vector(4, gaussian(0, 1)));
    EXPECT_TRUE(v.validated[0]);
    EXPECT_EQ(v.reason[0], "");
    EXPECT_EQ(v.delta[0], 0.05);  // u = 2.0
    EXPECT_NEAR(v.high[0], 3.92, 0.005);
    EXPECT_EQ(v.failures(), 0u);
    EXPECT_NEAR(v.sampling[0], 2.0 * 2.671 / std::sqrt(400'000.0), 1e-4);
}

TEST(Validation, SumOfFourRectanglesIsNotValidatedAtThreeDigits) {  // JCGM 101, 9.2.3: 3.88 instead of 3.92
    const Distribution rectangular{DistributionKind::rectangular, 0.0, std::sqrt(3.0)};
    const auto sum = [](const VectorXd& x) { return x.sum(); };
    EXPECT_TRUE(compared(sum, std::vector(4, rectangular)).validated[0]);
    const Validation v = compared(sum, std::vector(4, rectangular), "1", 4'000'000, 3);
    EXPECT_NEAR(v.d_high[0], 0.04, 0.006);
    expect_reason(v, {"1.94 u wide", "instead of 1.96 u"});
}

TEST(Validation, DominatingRectangleIsNamed) {  // JCGM 101, 9.2.4
    std::vector<Distribution> distributions(3, Distribution{DistributionKind::rectangular, 0.0, std::sqrt(3.0)});
    distributions.push_back({DistributionKind::rectangular, 0.0, 10.0 * std::sqrt(3.0)});
    const Validation v = compared([](const VectorXd& x) { return x.sum(); }, distributions);
    EXPECT_NEAR(v.d_high[0], 19.9 - 17.0, 0.1);  // as printed there
    expect_reason(v, {"1.68 u", "x3, rectangular, makes 97 % of the variance"});
}

TEST(Validation,
     SquareThatShiftsTheMeanIsNamedWithItsFigures) {  // mass calibration, JCGM 101, 9.3, in short: a product
    const Validation v = compared([](const VectorXd& x) { return 0.1e-6 * x[0] + 0.8e-6 * x[1] * x[1]; },
                                  {gaussian(0, 1), gaussian(0, 1)}, "rad");
    expect_reason(v, {"the mean is shifted by 0.8 urad", "the square of x1 moves it by 0.8 urad, u is 0.1 urad",
                      "u is 1.1 urad by Monte Carlo and 0.1 urad by propagation", "skew"});
}

TEST(Validation, ProductsOfInputsAreNotTakenForSquares) {
    const Validation v = compared([](const VectorXd& x) { return 0.1 * x[0] + x[1] * x[2]; },
                                  {gaussian(0, 1), gaussian(0, 1), gaussian(0, 1)}, "mm");
    expect_reason(v, {"products of two inputs"});
}

TEST(Validation, ScaledDistributionOfFewObservationsIsSaid) {
    const Validation v = compared([](const VectorXd& x) { return x.sum(); },
                                  {{DistributionKind::student_t, 0.0, 1.0, 4.0}, gaussian(0, 0.3)});
    expect_reason(v, {"t distribution"});
}

TEST(Validation, OutputsWithoutUncertaintyAreValidatedUnlessTheyMove) {
    const auto constant = [](const VectorXd& x) { return 5.0 + 0.0 * x[0]; };
    EXPECT_TRUE(compared(constant, {gaussian(0, 1)}, "mm", 20'000).validated[0]);
    const Validation v = compared([](const VectorXd& x) { return 1e-3 * x[0] * x[0]; }, {gaussian(0, 1)}, "mm");
    expect_reason(v, {"the square of x0 moves it by 1 um, u is 0 um"});
}

TEST(Validation, FewSamplesAreSaidToBeFew) {
    const Validation v = compared([](const VectorXd& x) { return x[0]; }, {gaussian(0, 0.99)}, "1", 10'000, 3);
    expect_reason(v, {"it may be chance"});
}

TEST(Validation, RefusesResultsOfOtherOutputs) {
    const auto f = [](const VectorXd& x) { return x[0]; };
    const auto propagation = propagated(f, {gaussian(0, 1)}, "mm");
    const auto result = drawn(f, {gaussian(0, 1)}, "rad", 20'000);
    expect_refused([&] { compare(propagation, result); }, "outputs");
    expect_refused([&] { compare(propagation, drawn(f, {gaussian(0, 1)}, "mm", 20'000), 4); }, "digits");
}
