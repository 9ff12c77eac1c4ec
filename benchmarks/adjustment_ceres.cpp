// Benchmark of Ceres for the run of adjustment.cpp, with the same unknowns, readings and weights. It uses the library's
// own model with analytic derivatives, one residual block for each point, and one parameter block for each node of an
// axis and each set-up. The settings are the fastest ones found. Times are processor time of one thread.
//   solve      from zero to the limit of double precision, including construction of the problem
//   variances  of all unknowns, after the solution
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>

#include <deque>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment_run.hpp"

namespace {

using stepdiag::AdjustedPoint;
using stepdiag::AdjustmentProblem;
using stepdiag::no_unknown;

// The unknown values of a node or a set-up, and their indices.
struct Unknowns {
    std::vector<int> components;
    std::vector<double> value;

    void add(int component) { components.push_back(component), value.push_back(0.0); }
};

// All unknowns, and the models of the set-ups. The models are prepared once per evaluation, not once per point.
struct State : ceres::EvaluationCallback {
    const AdjustmentProblem& problem;
    std::deque<Unknowns> nodes, setups;
    std::vector<stepdiag::ChannelModel> models;

    explicit State(const AdjustmentProblem& problem) : problem(problem) {
        for (const auto& node : problem.nodes()) {
            nodes.emplace_back();
            for (int c = 0; c < 6; ++c)
                if (node.unknown[c] != no_unknown) nodes.back().add(c);
        }
        for (const auto& setup : problem.setups()) {
            setups.emplace_back();
            for (const int c : setup.active) setups.back().add(c);
            models.push_back(setup.model);
        }
    }

    void PrepareForEvaluation(bool, bool new_point) override {
        for (std::size_t s = 0; new_point && s < models.size(); ++s) {
            Eigen::VectorXd all = Eigen::VectorXd::Zero(models[s].setup_size());
            for (std::size_t i = 0; i < setups[s].value.size(); ++i) all[setups[s].components[i]] = setups[s].value[i];
            models[s].set_up(all);
        }
    }
};

struct Point : ceres::CostFunction {
    const State& state;
    const AdjustedPoint& point;

    Point(const State& state, const AdjustedPoint& point) : state(state), point(point) {
        set_num_residuals(point.end_reading - point.first_reading);
        for (const Unknowns* block : blocks()) mutable_parameter_block_sizes()->push_back(int(block->value.size()));
    }

    // Parameter blocks of the axes that are not at home, and of the set-up.
    std::vector<const Unknowns*> blocks() const {
        std::vector<const Unknowns*> blocks;
        for (const int node : point.node)
            if (node != no_unknown) blocks.push_back(&state.nodes[node]);
        blocks.push_back(&state.setups[point.setup]);
        return blocks;
    }

    bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
        stepdiag::MachineErrors errors;
        int block = 0;
        for (int a = 0; a < 3; ++a) {
            errors[a].setZero();
            if (point.node[a] == no_unknown) continue;
            const std::vector<int>& components = state.nodes[point.node[a]].components;
            for (std::size_t i = 0; i < components.size(); ++i) errors[a][components[i]] = parameters[block][i];
            ++block;
        }
        const auto& model = state.models[point.setup];
        const auto pose = differentiate_pose(state.problem.chain(), state.problem.tool(), point.place.commanded, errors,
                                             jacobians != nullptr);
        Eigen::Vector3d value;
        thread_local stepdiag::ChannelDerivative derivative;
        derivative.resize(3, 18 + model.setup_size());
        model.read(pose, point.place, value, jacobians ? &derivative : nullptr);
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const auto& reading = state.problem.readings()[r];
            residuals[r - point.first_reading] =
                (value[reading.channel] - reading.value) / reading.standard_uncertainty;
        }
        block = 0;
        for (int a = 0; jacobians && a < 3; ++a)
            if (point.node[a] != no_unknown)
                fill(jacobians[block++], derivative, 6 * a, state.nodes[point.node[a]].components);
        if (jacobians) fill(jacobians[block], derivative, 18, state.setups[point.setup].components);
        return true;
    }

    void fill(double* to, const stepdiag::ChannelDerivative& derivative, int first,
              const std::vector<int>& components) const {
        if (!to) return;
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const auto& reading = state.problem.readings()[r];
            for (const int c : components)
                *to++ = derivative(reading.channel, first + c) / reading.standard_uncertainty;
        }
    }
};

struct Solution {
    State state;
    std::unique_ptr<ceres::Problem> ceres;
    ceres::Solver::Summary summary;

    explicit Solution(const AdjustmentProblem& problem) : state(problem) {
        ceres::Problem::Options options;
        options.evaluation_callback = &state;
        options.disable_all_safety_checks = true;
        ceres = std::make_unique<ceres::Problem>(options);
        for (const AdjustedPoint& point : problem.points()) {
            auto* cost = new Point(state, point);
            std::vector<double*> parameters;
            for (const Unknowns* block : cost->blocks()) parameters.push_back(const_cast<double*>(block->value.data()));
            ceres->AddResidualBlock(cost, nullptr, parameters);
        }

        ceres::Solver::Options solver;
        solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
        solver.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
        solver.initial_trust_region_radius = 1e16;  // Gauss-Newton
        solver.max_trust_region_radius = 1e32;
        solver.min_lm_diagonal = 1e-32;
        solver.function_tolerance = 0.0;
        solver.gradient_tolerance = 0.0;
        solver.parameter_tolerance = 1e-9;  // the steps are 1, 1e-1, 1e-6, 1e-11; the last one is rounding
        solver.num_threads = 1;
        solver.logging_type = ceres::SILENT;
        Solve(solver, ceres.get(), &summary);
    }

    bool covariance(ceres::Covariance& covariance) {
        std::vector<std::pair<const double*, const double*>> blocks;
        for (const auto* list : {&state.nodes, &state.setups})
            for (const Unknowns& block : *list) blocks.emplace_back(block.value.data(), block.value.data());
        return covariance.Compute(blocks, ceres.get());
    }
};

Eigen::Vector2d worst(const AdjustmentRun& run, const Solution& solution) {
    Eigen::Vector2d worst = Eigen::Vector2d::Zero();
    const stepdiag::ErrorMap& errors = run.machine.errors();
    for (std::size_t i = 0; i < solution.state.nodes.size(); ++i) {
        const stepdiag::AxisNode& node = solution.state.problem.nodes()[i];
        Eigen::Matrix<double, 6, 1> truth;
        truth << errors.delta(node.axis, node.position), errors.theta(node.axis, node.position);
        const Unknowns& found = solution.state.nodes[i];
        for (std::size_t k = 0; k < found.value.size(); ++k) {
            double& largest = worst[found.components[k] >= 3];
            largest = std::max(largest, std::abs(found.value[k] - truth[found.components[k]]));
        }
    }
    return worst;
}

AdjustmentProblem problem_of(const AdjustmentRun& run) {
    return AdjustmentProblem(run.run(), run.plan, run.machine.chain(), run.machine.tool(), run.head.calibration(),
                             three_quantities());
}

void solve(benchmark::State& state) {
    const AdjustmentRun run(int(state.range(0)));
    const AdjustmentProblem problem = problem_of(run);
    const Eigen::Vector2d errors = worst(run, Solution(problem));
    run.check(errors);
    for (auto _ : state) benchmark::DoNotOptimize(Solution(problem).summary.final_cost);
    state.counters["mm"] = errors[0];
    state.counters["rad"] = errors[1];
}

void variances(benchmark::State& state) {
    const AdjustmentRun run(int(state.range(0)));
    const AdjustmentProblem problem = problem_of(run);
    Solution solution(problem);
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    for (auto _ : state)
        if (!solution.covariance(covariance)) expect_near(0.0, 1.0, 0.0, "covariance of Ceres");

    const auto calibration = run.adjust(run.run(), three_quantities()).calibration;
    const auto& exx = *calibration.functions[0];
    for (std::size_t i = 0; i < problem.nodes().size(); ++i) {
        const stepdiag::AxisNode& node = problem.nodes()[i];
        if (node.axis != stepdiag::Axis::X) continue;
        const Unknowns& unknowns = solution.state.nodes[i];
        std::vector<double> block(unknowns.value.size() * unknowns.value.size());
        covariance.GetCovarianceBlock(unknowns.value.data(), unknowns.value.data(), block.data());
        // Rounding of 1e-16 times the squared condition number, 1e8.
        expect_near(std::sqrt(block[0]) / exx.standard_uncertainty[node.node], 1.0, 1e-8, "u(EXX)");
    }
}

BENCHMARK(solve)->Arg(50)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(variances)->Arg(50)->Unit(benchmark::kMillisecond);
BENCHMARK(variances)->Name("slow/variances")->Arg(1000)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
