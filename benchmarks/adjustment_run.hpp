// Run for the benchmarks of the adjustment: four body diagonals of 800 x 600 x 500 mm and three scale lines with the
// ideal head, set-ups misaligned by up to 1 mrad. benchmarks/peers/adjustment.py makes the same run.
#pragma once

#include <algorithm>
#include <cmath>

#include "expect.hpp"
#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/simulation/simulate.hpp"

// Unknowns of the set-ups: reflector, laser and distance constant; on scale lines the distance constant only.
inline stepdiag::AdjustmentOptions three_quantities() {
    using stepdiag::SetupQuantity;
    stepdiag::AdjustmentOptions options;
    for (const auto quantity : {SetupQuantity::lateral, SetupQuantity::roll, SetupQuantity::gain})
        options.setup[static_cast<int>(quantity)] = stepdiag::fixed_unknown;
    for (const char* scale_line : {"p00", "0p0", "00p"})
        options.setup_by_line[scale_line][static_cast<int>(SetupQuantity::laser)] = stepdiag::fixed_unknown;
    return options;
}

struct AdjustmentRun {
    using Line = stepdiag::Line;

    Eigen::Vector3d volume{800.0, 600.0, 500.0};
    stepdiag::Plan plan;
    stepdiag::Head head;
    stepdiag::Machine machine{stepdiag::Chain::parse("[w X' b Y Z t]"), stepdiag::make_random_error_map(volume, {})};

    explicit AdjustmentRun(int steps)
        : plan(volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")}, steps,
               stepdiag::all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")}) {}

    stepdiag::Measurement run(const stepdiag::Noise& noise = {}) const {
        stepdiag::SimulationOptions options;
        options.noise = noise;
        options.misalignment["ppp"] = {{1e-3, -0.5e-3}, {0.4e-3, 0.8e-3}};
        options.misalignment["npp"] = {{-0.7e-3, 0.2e-3}, {-0.9e-3, 0.1e-3}};
        options.misalignment["pnp"] = {{0.3e-3, 0.6e-3}, {0.2e-3, -1e-3}};
        options.misalignment["nnp"] = {{-0.1e-3, -0.8e-3}, {-0.3e-3, 0.5e-3}};
        return simulate(machine, plan, head, options);
    }
    stepdiag::Adjustment adjust(const stepdiag::Measurement& run, const stepdiag::AdjustmentOptions& options) const {
        return stepdiag::adjust(run, plan, machine.chain(), machine.tool(), head.calibration(), options);
    }

    // Largest deviations from the machine's errors: mm, rad.
    Eigen::Vector2d worst(const stepdiag::Calibration& calibration) const {
        Eigen::Vector2d worst = Eigen::Vector2d::Zero();
        for (int i = 0; i < stepdiag::function_count; ++i) {
            const auto id = stepdiag::FunctionId::at(i);
            const auto& function = calibration.functions[i];
            expect_near(function ? double(function->position.size()) : 0.0, plan.steps() + 1.0, 0.0, "nodes");
            for (std::size_t k = 0; k < function->position.size(); ++k) {
                const double difference = function->value[k] - machine.errors().function(id, function->position[k]);
                worst[id.is_rotation()] = std::max(worst[id.is_rotation()], std::abs(difference));
                if (k > 0 && !(function->standard_uncertainty[k] > 0.0) &&
                    !(id.is_straightness() && k + 1 == function->position.size()))
                    expect_near(0.0, 1.0, 0.0, "a standard uncertainty");
            }
        }
        return worst;
    }

    void check(const Eigen::Vector2d& worst) const {
        // Each reading has a rounding of 1e-13 mm. A function is a sum over as many readings as there are steps.
        const double roundings = plan.steps() / 50.0;
        expect_near(worst[0], 0.0, 2e-11 * roundings, "largest error of position");
        expect_near(worst[1], 0.0, 1e-13 * roundings, "largest error of angle");
    }
};
