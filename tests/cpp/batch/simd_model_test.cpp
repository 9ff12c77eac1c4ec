// The adjustment's model in lanes, forwards and back, against the text of the physics in dual numbers.
#include "batch/simd_model.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "support/batch_workshop.hpp"
#include "support/model_text.hpp"

namespace {

using namespace batch_tests;
using Eigen::VectorXd;
using stepdiag::AdjustedPoint;
using stepdiag::AdjustmentProblem;
using stepdiag::LineSetup;
using stepdiag::no_unknown;

AdjustmentProblem make_problem(Workshop shop) {
    shop.seconds = 3.0;
    shop.head.nominal.spot_beam = {25.0, -3.0};
    for (auto& prior : shop.options.setup) prior = stepdiag::free_unknown;
    return {shop.pattern(), shop.plan(), shop.machine().chain(), shop.tool, shop.head.calibration(), shop.options};
}

// What `evaluate` is given and gives, in lanes. After the last unknown there is one that is none.
struct Lanes16 {
    AdjustmentProblem problem;
    std::vector<double> x, readings, s, r, pulled;
    bool is_valid[lane_group];

    Lanes16(const Workshop& shop, double angle) : problem(make_problem(shop)) {
        const std::size_t unknowns = std::size_t(problem.size()) + 1, count = problem.readings().size();
        std::mt19937 generator(5);
        std::normal_distribution<double> normal;
        x.resize(unknowns * lane_group), pulled.resize(x.size());
        s.resize(count * lane_group), r.resize(s.size());
        for (std::size_t i = 0; i < x.size() - lane_group; ++i)
            x[i] = angle * normal(generator) / problem.change_scale()[i / lane_group];
        for (double& each : s) each = normal(generator);
        for (const auto& reading : problem.readings()) readings.insert(readings.end(), lane_group, reading.value);
        std::vector<std::ptrdiff_t> input(count);
        std::iota(input.begin(), input.end(), 0);
        stepdiag::SimdModel(problem, input)
            .evaluate({x.data(), readings.data(), lane_group, s.data(), r.data(), pulled.data(), is_valid});
    }
};

// The unknown that each parameter of a point is.
std::vector<int> unknowns_of(const AdjustmentProblem& problem, const AdjustedPoint& point) {
    std::vector<int> unknowns;
    for (const int node : point.node)
        for (int c = 0; c < 6; ++c)
            unknowns.push_back(node == no_unknown ? no_unknown : problem.nodes()[node].unknown[c]);
    const LineSetup& setup = problem.setups()[point.setup];
    unknowns.resize(18 + setup.unknown.size(), no_unknown);
    for (const int c : setup.active) unknowns[18 + c] = setup.unknown[c];
    return unknowns;
}

VectorXd parameters_of(const AdjustmentProblem& problem, const AdjustedPoint& point, const VectorXd& x) {
    const VectorXd setup = problem.setup_values(problem.setups()[point.setup], x);
    VectorXd parameters(18 + setup.size());
    const auto errors = problem.errors(point, x);
    parameters << errors[0], errors[1], errors[2], setup;
    return parameters;
}

void expect_text(const Lanes16& lanes, std::size_t lane) {
    const AdjustmentProblem& problem = lanes.problem;
    VectorXd x(problem.size()), pulled = VectorXd::Zero(problem.size()), size = pulled;
    for (Eigen::Index j = 0; j < x.size(); ++j) x[j] = lanes.x[std::size_t(j) * lane_group + lane];
    for (const AdjustedPoint& point : problem.points()) {
        const stepdiag::KnownPoint known{problem.chain(), problem.tool(), problem.setups()[point.setup].model,
                                         point.place};
        const VectorXd parameters = parameters_of(problem, point, x);
        const auto channels = read_channels(known, std::vector<double>(parameters.begin(), parameters.end()));
        const std::vector<int> unknowns = unknowns_of(problem, point);
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const auto& reading = problem.readings()[r];
            const double u = reading.standard_uncertainty, value = channels[reading.channel];
            // A metre, rounded a few times; forwards in another order.
            EXPECT_NEAR(lanes.r[r * lane_group + lane], (reading.value - value) / u, 2e-12 / u);
        }
        for (std::size_t k = 0; k < unknowns.size(); ++k) {
            if (unknowns[k] == no_unknown) continue;
            const VectorXd slopes = derivative(known, parameters, Eigen::Index(k));
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                const auto& reading = problem.readings()[r];
                const double force = lanes.s[r * lane_group + lane] / reading.standard_uncertainty;
                pulled[unknowns[k]] += force * slopes[reading.channel];
                size[unknowns[k]] += std::abs(force) * 1e3 * problem.change_scale()[unknowns[k]];
            }
        }
    }
    // An angle moves a reading by up to its arm, some metres.
    for (Eigen::Index j = 0; j < pulled.size(); ++j)
        EXPECT_NEAR(lanes.pulled[std::size_t(j) * lane_group + lane], pulled[j], 1e-14 * size[j]) << "unknown " << j;
}

TEST(SimdModel, ResidualsAndForcesAreThoseOfTheTextInDualNumbers) {
    for (const char* chain : {"[w X' b Y Z t]", "[w b Z X Y t]", "[w Y' Z' X' b t]"})
        for (Workshop shop : {Workshop(), with_psd(), with_beams()}) {
            shop.chain = chain;
            const Lanes16 lanes(shop, 3e-3);
            for (const std::size_t lane : {std::size_t(0), lane_group - 1}) {
                EXPECT_TRUE(lanes.is_valid[lane]);
                expect_text(lanes, lane);
            }
        }
}

TEST(SimdModel, LanesTurnedBeyondTheSeriesAreToldApart) {
    const Lanes16 lanes({}, 0.1);
    for (const bool valid : lanes.is_valid) EXPECT_FALSE(valid);
}

}  // namespace
