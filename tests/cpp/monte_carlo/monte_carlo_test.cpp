#include "stepdiag/monte_carlo/monte_carlo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/units.hpp"
#include "stepdiag/monte_carlo/function_model.hpp"
#include "support/refuses.hpp"

using namespace stepdiag;

namespace {

using Values = FunctionModel::Values;
const double nan_value = std::numeric_limits<double>::quiet_NaN();

Distribution of_kind(DistributionKind kind, double expectation, double spread) { return {kind, expectation, spread}; }

std::vector<SampleModel::Output> outputs(const std::vector<std::string>& names) {
    std::vector<SampleModel::Output> all;
    for (const std::string& name : names) all.push_back({name, nan_value, "1"});
    return all;
}

// A linear one, a curved one, a constant one.
FunctionModel three_outputs(std::uint64_t seed = 1) {
    return FunctionModel(
        [](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) {
            y.row(0) = x.row(0) + 2.0 * x.row(1);
            y.row(1) = x.row(0).square();
            y.row(2).setConstant(0.25);
        },
        {of_kind(DistributionKind::normal, 1.0, 3.0), of_kind(DistributionKind::rectangular, 0.0, 1.0)},
        outputs({"sum", "square", "constant"}), seed);
}

FunctionModel sum_of_four(DistributionKind kind, double spread) {
    const Distribution each = of_kind(kind, 0.0, spread);
    return FunctionModel([](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) { y.row(0) = x.colwise().sum(); },
                         {each, each, each, each}, outputs({"sum"}), 5);
}

// Some samples have no result: all outputs are NaN where the first input is above 1.
FunctionModel with_lost_samples() {
    return FunctionModel(
        [](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) {
            for (Eigen::Index s = 0; s < x.cols(); ++s) y.col(s).setConstant(x(0, s) > 1.0 ? nan_value : x(0, s));
        },
        {of_kind(DistributionKind::normal, 0.0, 1.0)}, outputs({"a", "b"}), 3);
}

StatisticsOptions everything() {
    StatisticsOptions options;
    options.covariance = true;
    options.kept = {1};
    options.joint = {{0, 1}, {1}};
    return options;
}

RunControl threads(int count) { return {count}; }

}  // namespace

TEST(NumericalTolerance, IsHalfAUnitOfTheLastSignificantDigit) {  // JCGM 101, 7.9.2
    EXPECT_DOUBLE_EQ(numerical_tolerance(0.00035, 2), 0.000005);
    EXPECT_DOUBLE_EQ(numerical_tolerance(2.0, 1), 0.5);
    EXPECT_DOUBLE_EQ(numerical_tolerance(2.0, 2), 0.05);
    EXPECT_DOUBLE_EQ(numerical_tolerance(9.97, 2), 0.5);  // 10
    EXPECT_DOUBLE_EQ(numerical_tolerance(9.94, 2), 0.05);
}

TEST(MonteCarlo, SumOfFourNormalsIsThatOfJcgm101) {  // 9.2.2: u = 2.00, 95 %: -3.92 to 3.92
    const FunctionModel model = sum_of_four(DistributionKind::normal, 1.0);
    const MonteCarloResult result = monte_carlo(model, {}, 1'000'000);
    EXPECT_EQ(result.samples, 1'000'000u);
    EXPECT_NEAR(result.mean[0], 0.0, 5 * 2.0e-3);                  // five standard deviations of the mean
    EXPECT_NEAR(result.standard_uncertainty[0], 2.0, 5 * 1.5e-3);  // and of u: u / sqrt(2 n)
    for (const double end : {-result.symmetric(0, 0), result.symmetric(0, 1)})
        EXPECT_NEAR(end, 3.92, 0.03);  // a quantile's standard deviation is 0.0053, the standard prints two decimals
    // The shortest one slides along where the distribution is flat; its length does not.
    EXPECT_NEAR(result.shortest(0, 1) - result.shortest(0, 0), 7.84, 0.03);
    EXPECT_LE(result.shortest(0, 1) - result.shortest(0, 0), result.symmetric(0, 1) - result.symmetric(0, 0));
}

TEST(MonteCarlo, SumOfFourRectangularIsThatOfJcgm101) {  // 9.2.3: u = 2.00, 95 %: -3.88 to 3.88
    const FunctionModel model = sum_of_four(DistributionKind::rectangular, std::sqrt(3.0));
    const MonteCarloResult result = monte_carlo(model, {}, 1'000'000);
    EXPECT_NEAR(result.standard_uncertainty[0], 2.0, 0.0075);
    for (const double end : {-result.symmetric(0, 0), result.symmetric(0, 1)}) EXPECT_NEAR(end, 3.88, 0.03);
}

TEST(MonteCarlo, ShortestIntervalOfALogarithmIsTheClosedForm) {
    // y = ln x, x uniform in 0.1 to 1.1: the density rises to the upper end, so the shortest interval ends there.
    const FunctionModel model([](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) { y = x.log(); },
                              {of_kind(DistributionKind::rectangular, 0.6, 0.5)}, outputs({"ln"}), 9);
    const MonteCarloResult result = monte_carlo(model, {}, 400'000);
    EXPECT_NEAR(result.shortest(0, 0), std::log(0.15), 0.012);  // five times sqrt(0.05 * 0.95 / n) / density 0.15
    EXPECT_NEAR(result.shortest(0, 1), std::log(1.1), 1e-4);
    EXPECT_NEAR(result.symmetric(0, 0), std::log(0.125), 0.012);
    EXPECT_NEAR(result.symmetric(0, 1), std::log(1.075), 0.002);
}

TEST(MonteCarlo, FiguresAreThoseOfTheKeptValuesThemselves) {
    const FunctionModel model = three_outputs();
    StatisticsOptions options = everything();
    options.kept = {0, 1, 2};
    const MonteCarloResult result = monte_carlo(model, options, 20'000);
    const Eigen::Index n = 20'000;
    Eigen::MatrixXd values(n, 3);
    for (std::size_t i = 0; i < 3; ++i) {
        ASSERT_EQ(result.kept.at(i).size(), std::size_t(n));
        values.col(Eigen::Index(i)) = Eigen::Map<const Eigen::VectorXd>(result.kept.at(i).data(), n);
    }
    const Eigen::RowVectorXd mean = values.colwise().mean();
    const Eigen::MatrixXd deviations = values.rowwise() - mean;
    const Eigen::MatrixXd covariance = deviations.transpose() * deviations / double(n - 1);
    EXPECT_LT((result.mean - mean.transpose()).cwiseAbs().maxCoeff(), 1e-11);  // roundings of 20,000 summands
    EXPECT_LT((*result.covariance - covariance).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((result.standard_uncertainty - covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff(), 1e-10);
    for (Eigen::Index i = 0; i < 2; ++i) {
        std::vector<double> sorted = result.kept.at(std::size_t(i));
        std::sort(sorted.begin(), sorted.end());
        const double width = numerical_tolerance(result.standard_uncertainty[i], 2) / 5.0;  // of a bin
        EXPECT_NEAR(result.symmetric(i, 0), sorted[500], width);
        EXPECT_NEAR(result.symmetric(i, 1), sorted[19500], width);
        double shortest = 1e300;
        for (std::size_t k = 0; k + 19000 < sorted.size(); ++k)
            shortest = std::min(shortest, sorted[k + 19000] - sorted[k]);
        EXPECT_NEAR(result.shortest(i, 1) - result.shortest(i, 0), shortest, 2.0 * width);
        EXPECT_EQ(result.lowest[i], sorted.front());
        EXPECT_EQ(result.highest[i], sorted.back());
    }
    EXPECT_EQ(result.mean[2], 0.25);
    EXPECT_EQ(result.standard_uncertainty[2], 0.0);
    EXPECT_EQ(result.symmetric.row(2), Eigen::RowVector2d(0.25, 0.25));
    EXPECT_EQ(result.shortest.row(2), Eigen::RowVector2d(0.25, 0.25));
}

TEST(MonteCarlo, CovarianceOfManyOutputsIsThatOfTheirCombinations) {
    // 130 outputs: more than a panel of the blocked sum, no multiple of its tile.
    const Eigen::Index count = 130;
    const Eigen::MatrixXd a = (Eigen::MatrixXd::Random(count, 5).array() * 3.0).matrix();
    const std::vector<Distribution> inputs(5, of_kind(DistributionKind::normal, 0.0, 1.0));
    const FunctionModel model([&](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) { y = (a * x.matrix()).array(); },
                              inputs, outputs(std::vector<std::string>(std::size_t(count), "y")));
    StatisticsOptions options;
    options.covariance = true;
    options.kept = {0, 129};
    const MonteCarloResult result = monte_carlo(model, options, 40'000);
    const Eigen::MatrixXd exact = a * a.transpose();
    const double scale = exact.diagonal().maxCoeff();
    // Five standard deviations of an element: sqrt(2 / n).
    EXPECT_LT((*result.covariance - exact).cwiseAbs().maxCoeff(), 5.0 * scale * std::sqrt(2.0 / 40'000));
    EXPECT_EQ(*result.covariance, Eigen::MatrixXd(result.covariance->transpose()));
    const Eigen::VectorXd variances = result.standard_uncertainty.array().square();
    EXPECT_LT((result.covariance->diagonal() - variances).cwiseAbs().maxCoeff(), 1e-10 * scale);  // order of sums
    double product = 0.0;
    for (std::size_t s = 0; s < 40'000; ++s)
        product += (result.kept.at(0)[s] - result.mean[0]) * (result.kept.at(129)[s] - result.mean[129]);
    EXPECT_NEAR((*result.covariance)(129, 0), product / 39'999, 1e-10 * scale);
}

TEST(MonteCarlo, SamplesWithoutAResultAreCountedAndLeftOut) {
    StatisticsOptions options;
    options.kept = {0};
    const MonteCarloResult result = monte_carlo(with_lost_samples(), options, 20'000);
    std::uint64_t lost = 0;
    double sum = 0.0;
    for (const double value : result.kept.at(0)) std::isnan(value) ? void(++lost) : void(sum += value);
    EXPECT_NEAR(double(lost), 20'000 * 0.158655, 5.0 * std::sqrt(20'000 * 0.158655 * 0.841345));
    EXPECT_EQ(result.lost, lost);
    EXPECT_EQ(result.samples + result.lost, 20'000u);
    EXPECT_NEAR(result.mean[0], sum / double(result.samples), 1e-12);
    EXPECT_EQ(result.mean[0], result.mean[1]);
    EXPECT_LE(result.highest[0], 1.0);

    const FunctionModel none([](Eigen::Ref<const Values>, Eigen::Ref<Values> y) { y.setConstant(nan_value); },
                             {of_kind(DistributionKind::normal, 0.0, 1.0)}, outputs({"a"}));
    expect_refused([&] { monte_carlo(none, {}, 2000); }, "none of the first 10000 samples has a result");
}

TEST(MonteCarlo, JointRegionsOfNormalOutputsAreThoseOfJcgm102) {
    // Two independent and one correlated output: k_p^2 is the quantile of chi-square with 2 degrees of freedom.
    const FunctionModel model([](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) { y = x; },
                              std::vector<Distribution>(2, of_kind(DistributionKind::normal, 2.0, 1.0)),
                              outputs({"a", "b"}), 4, {{{0, 1}, (Eigen::Matrix2d() << 1.0, 0.9, 0.9, 1.0).finished()}});
    StatisticsOptions options;
    options.joint = {{0, 1}, {1}};
    const MonteCarloResult result = monte_carlo(model, options, 400'000);
    const JointRegion& pair = result.joint[0];
    EXPECT_NEAR(pair.ellipsoid_factor, std::sqrt(-2.0 * std::log(0.05)), 0.03);  // 2.45 (JCGM 102, table 1)
    EXPECT_NEAR(pair.rectangle_factor, 2.08, 0.03);  // between 1.96 (correlation 1) and 2.236 (none)
    EXPECT_NEAR(pair.centre[0], 2.0, 0.05);
    EXPECT_NEAR(pair.covariance(0, 1), 0.9, 0.05);
    // The smallest region of a normal is its ellipse, here made of cells: a little larger than it for its rim.
    EXPECT_NEAR(pair.smallest_share, 0.95, 0.001);
    EXPECT_GT(pair.smallest_volume, 0.9 * pair.ellipsoid_volume);
    EXPECT_LT(pair.smallest_volume, 1.1 * pair.ellipsoid_volume);
    EXPECT_NEAR(result.joint[1].ellipsoid_factor, 1.96, 0.03);
    EXPECT_NEAR(result.joint[1].ellipsoid_factor, result.joint[1].rectangle_factor, 1e-12);
}

TEST(MonteCarlo, JointRegionsOfThreeIndependentOutputsHaveTheFactorsOfJcgm102) {
    // Units of their own: factors do not know them.
    const FunctionModel model(
        [](Eigen::Ref<const Values> x, Eigen::Ref<Values> y) {
            y.row(0) = 1e-6 * x.row(0);
            y.row(1) = 1e3 + x.row(1);
            y.row(2) = 1e4 * x.row(2);
        },
        std::vector<Distribution>(3, of_kind(DistributionKind::normal, 0.0, 1.0)), outputs({"a", "b", "c"}), 6);
    StatisticsOptions options;
    options.joint = {{2, 0, 1}};
    const JointRegion region = monte_carlo(model, options, 1'000'000).joint[0];
    EXPECT_NEAR(region.ellipsoid_factor, 2.80, 0.02);  // JCGM 102, table 1: square root of chi-square, 3 degrees
    EXPECT_NEAR(region.rectangle_factor, 2.39, 0.02);  // normal quantile of (1 + 0.95^(1/3)) / 2
    EXPECT_NEAR(region.ellipsoid_volume / (4.0 / 3.0 * pi * std::pow(2.80, 3) * 1e-2), 1.0, 0.05);
    EXPECT_NEAR(region.rectangle_volume / (std::pow(2.0 * 2.39, 3) * 1e-2), 1.0, 0.05);
    EXPECT_GT(region.smallest_volume, 0.85 * region.ellipsoid_volume);  // cells of a quarter of u
    EXPECT_LT(region.smallest_volume, 1.1 * region.ellipsoid_volume);
    EXPECT_NEAR(region.smallest_share, 0.95, 0.001);
}

TEST(MonteCarlo, OptionsThatMakeNoSenseAreRefused) {
    const FunctionModel model = three_outputs();
    const auto with = [&](auto change) {
        StatisticsOptions options;
        change(options);
        return [&model, options] { make_bins(model, options); };
    };
    using Options = StatisticsOptions;
    expect_refused(with([](Options& o) { o.coverage = 1.0; }), "coverage");
    expect_refused(with([](Options& o) { o.digits = 4; }), "digits");
    expect_refused(with([](Options& o) { o.kept = {3}; }), "kept: expected outputs 0 to 2, got 3");
    expect_refused(with([](Options& o) { o.kept = {1, 1}; }), "kept: output 1 is given twice");
    expect_refused(with([](Options& o) { o.joint = {{0, 1, 2, 0}}; }), "one to three");
    expect_refused([&] { make_bins(model, {}, threads(-1)); }, "threads");
}
