// A machine, its calibration, and a short run later.
#pragma once

#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "support/usual.hpp"

namespace stepdiag::test {

// A machine, the run that calibrates it, and the run that tests the calibration: another tool path, other set-ups.
struct RecheckWorkshop {
    int steps = 6;
    Head head = {};
    Eigen::Vector3d volume = test::volume, tool{20.0, -10.0, 50.0};
    std::uint64_t machine_seed = 3;
    std::vector<Line> test_lines = {Line::parse("ppp"), Line::parse("pnp")};
    double hit = 0.0;    // what C0Y has become larger by
    double screw = 0.0;  // mm: amplitude of a new error of X's screw

    Machine machine() const {
        RandomErrorMap errors;
        errors.intervals = steps;
        errors.seed = machine_seed;
        ParameterTable table = make_random_error_map(volume, errors).table();
        table.squarenesses[0]->value += hit;
        FunctionTable& positioning = *table.functions[0];
        for (std::size_t k = 0; k < positioning.position.size(); ++k)
            positioning.value[k] += screw * std::sin(2.0 * positioning.position[k]);
        return {chain, ErrorMap(table), tool};
    }
    Plan plan() const { return {volume, diagonals, steps, all_axes, scale_lines}; }
    // In larger steps.
    Plan test_plan() const { return {volume, test_lines, steps / 2, all_axes, {}}; }
    static SimulationOptions simulation(const Plan& plan, std::uint64_t seed) {
        SimulationOptions options;
        double angle = 300e-6;
        for (const Line& line : plan.lines()) {
            options.misalignment[line.name()].reflector = {angle, -0.5 * angle};
            options.misalignment[line.name()].laser = {1e-3 - angle, angle};
            options.misalignment[line.name()].distance_constant = 7.0;
            angle += 200e-6;
        }
        options.noise.distance = 0.1e-3;
        options.noise.tilt = 1e-6;
        options.noise.spot = 1e-3;
        options.noise.seed = seed;
        return options;
    }
    Measurement run(std::uint64_t seed) const { return simulate(machine(), plan(), head, simulation(plan(), seed)); }
    Measurement test_run(std::uint64_t seed) const {
        return simulate(machine(), test_plan(), head, simulation(test_plan(), seed));
    }
    // One distance reads too much.
    Measurement test_run_with(std::size_t row, double wrong) const {
        const Measurement run = test_run(2);
        auto channels = run.channels();
        channels[0].value[row] = *channels[0].value[row] + wrong;
        return Measurement(run.stations(), std::move(channels));
    }
    Calibration calibration(std::uint64_t seed) const {
        AdjustmentOptions options;
        options.full_covariance = true;
        return adjust(run(seed), plan(), machine().chain(), tool, head.calibration(), options).calibration;
    }
    // The simulated set-ups have none of these, so that a prior would count as a reading without error.
    AdjustmentOptions aligned_priors() const {
        AdjustmentOptions options;
        for (const auto quantity : {SetupQuantity::lateral, SetupQuantity::roll, SetupQuantity::gain})
            options.setup[std::size_t(quantity)] = fixed_unknown;
        return options;
    }
};

}  // namespace stepdiag::test
