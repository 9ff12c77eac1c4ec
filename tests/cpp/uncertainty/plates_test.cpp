#include "uncertainty/plates.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stepdiag/uncertainty/virtual_calibration.hpp"
#include "support/virtual_runs.hpp"
#include "uncertainty/beam_paths.hpp"

namespace {

using namespace stepdiag;
using namespace stepdiag::test;

VirtualRun run_with(const HeadDesign& design) {
    VirtualRun run = run_of(Kind::psd_traced);
    run.heads = make_head(design, 100.0);
    run.inputs.inputs = setup_inputs(Kind::psd_traced);
    return run;
}

// Layout b with a body of another material, or turned.
HeadDesign with_body(std::size_t body, Material material, const Eigen::Vector3d& turn) {
    HeadDesign design = beam_and_psd();
    design.bodies[body].material = std::move(material);
    design.bodies[body].placement.rotation = rotation_exp(turn);
    return design;
}

}  // namespace

TEST(Plates, WindowAndSplitterOfLayoutBAreOneThicknessOfGlass) {
    const VirtualRun run = run_with(beam_and_psd());
    const RunModel model(run, 1);
    const HeadPaths paths = record_paths(model, *model.passes.front().place.head).value();
    ASSERT_EQ(paths.beams.size(), 2u);
    const std::vector<double> glass = {5.0, 25.0}, last = {0.0, -50.0};
    for (std::size_t b = 0; b < 2; ++b) {
        const Plates& plates = paths.beams[b].plates.value();
        EXPECT_EQ(paths.beams[b].mirror_at + plates.faces + 1, paths.beams[b].route.encounters.size());
        ASSERT_EQ(plates.glasses.size(), 1u);
        // Rounding of corners some centimetres from the origin.
        EXPECT_NEAR(plates.glasses[0].thickness, glass[b], 1e-12);
        EXPECT_NEAR(plates.first, 14.5, 1e-12);
        EXPECT_NEAR(plates.last, last[b], 1e-12);
        EXPECT_NEAR(plates.half_size[0], 5.0, 2e-3);  // detectors of 10 mm, with a little to spare
        EXPECT_NEAR(plates.centre[0], 20.0 * double(b), 1e-12);
    }
}

TEST(Plates, WindowOfAnyGlassAndInclinationIsReadAsTheScalarSamplerReads) {
    const Glass bk7 = find_glass("N-BK7");
    constexpr std::size_t window = 0, splitter = 1;
    struct Case {
        const char* name;
        HeadDesign design;
        std::size_t faces, glasses;  // of the laser's plates
    };
    const Eigen::Vector3d straight(0.0, 0.0, 0.0);
    const std::vector<Case> cases = {{"as designed", with_body(window, bk7, straight), 6, 1},
                                     {"another glass", with_body(window, find_glass("F2"), straight), 6, 2},
                                     {"window turned about its normal", with_body(window, bk7, {0.0, 0.0, 0.1}), 0, 0},
                                     {"inclined splitter", with_body(splitter, bk7, {1e-3, 0.0, 0.0}), 2, 1}};
    for (const Case& each : cases) {
        VirtualRun run = run_with(each.design);
        run.simulation.environment = Environment{Air{}};
        run.inputs.inputs.push_back(normal(SharedQuantity::temperature, 0.5));
        const RunModel run_model(run, 1);
        const auto paths = record_paths(run_model, *run_model.passes.front().place.head);
        ASSERT_TRUE(paths) << each.name;
        const auto& plates = paths->beams[1].plates;
        EXPECT_EQ(plates ? plates->faces : 0u, each.faces) << each.name;
        EXPECT_EQ(plates ? plates->glasses.size() : 0u, each.glasses) << each.name;

        const VirtualCalibrations model(run, {}, 1);
        std::vector<double> outputs(model.outputs().size() * 16), lanes(outputs.size());
        model.worker()->evaluate({0, 16, outputs.data()});
        EXPECT_EQ(model.count().replayed, 16u) << each.name;
        for (std::uint64_t sample = 0; sample < 16; ++sample) {
            const Eigen::VectorXd readings = model.readings(sample);
            std::vector<double> copies;
            for (const double reading : readings) copies.insert(copies.end(), 16, reading);
            BatchEvaluator::Worker(model.evaluator()).evaluate(copies.data(), 16, lanes.data(), 16);
            for (std::size_t i = 0; i < model.outputs().size(); ++i)
                // Rounding of traces over some metres, summed over three steps and a volume of a metre.
                ASSERT_NEAR(outputs[16 * i + sample], lanes[16 * i], 2e-11) << each.name;
        }
    }
}
