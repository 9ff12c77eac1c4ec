#include "stepdiag/simulation/virtual_readout.hpp"

#include <gtest/gtest.h>

#include "simulation/two_diagonals.hpp"
#include "support/refuses.hpp"
#include "support/usual.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Chain;
using stepdiag::Head;
using stepdiag::HeadLayout;
using stepdiag::Line;
using stepdiag::Machine;
using stepdiag::Plan;
using stepdiag::SimulationOptions;
using stepdiag::VirtualReadout;
using stepdiag::test::chain;
using stepdiag::test::volume;
using stepdiag::test::two_diagonals::machine;
using stepdiag::test::two_diagonals::plan;

Head three_beams() {
    Head head;
    head.layout = HeadLayout::multi_beam;
    head.beam_offsets = {{15.0, 0.0}, {-7.5, 13.0}, {-7.5, -13.0}};
    return head;
}

SimulationOptions options() {
    SimulationOptions options;
    options.misalignment["nnp"].reflector = Vector2d(1e-4, -2e-4);
    options.misalignment["nnp"].drift = 1e-6;
    options.noise.distance = 1e-4;
    options.noise.common = 2e-4;
    options.noise.seed = 9;
    options.repeats = 2;
    options.backward = true;
    options.seconds_per_reading = 2.0;
    return options;
}

}  // namespace

TEST(VirtualReadout, RowsOfASimulatedRunAreReadToTheBit) {
    for (const Head& head : {Head{}, three_beams()}) {
        const auto run = simulate(machine(), plan(4), head, options());
        const std::vector<std::string> names = signal_names(head);
        std::uint64_t setup_row = 0;
        for (std::size_t row = 0; row < run.size(); ++row) {
            const auto& station = run.stations()[row];
            if (station.point == 0 && station.direction == stepdiag::Direction::forward) setup_row = row;
            const VirtualReadout readout(machine(), plan(4), head, station.line, options());
            const auto signals = readout.read(station.commanded, approaches(station.line, station.direction), row,
                                              2.0 * double(row - setup_row));
            for (std::size_t c = 0; c < names.size(); ++c) EXPECT_EQ(signals[c], run.find(names[c])->value[row]);
        }
    }
}

TEST(VirtualReadout, ReadsTheTravelBetweenThePointsOfThePlan) {
    const Machine perfect(Chain::parse("[w b X Y Z t]"), {}, {1.0, 2.0, 3.0});
    const VirtualReadout readout(perfect, plan(4), three_beams(), Line::parse("ppp"));
    const Vector3d position(123.4, 56.7, 8.9);
    // Distances of some 100 mm: a few units in the last place.
    for (const auto& signal : readout.read(position))
        EXPECT_NEAR(*signal, 100.0 + plan(4).frame(Line::parse("ppp")).col(2).dot(position), 1e-12);
}

TEST(VirtualReadout, MirrorThatIsMissedIsALostReading) {
    const VirtualReadout readout(machine(), plan(4), Head{}, Line::parse("ppp"));
    EXPECT_TRUE(readout.read(Vector3d(0, 0, 0)).front());
    EXPECT_FALSE(readout.read(Vector3d(0, -5000, 0)).front());
}

TEST(VirtualReadout, RefusesWhatSimulateRefuses) {
    expect_refused([&] { VirtualReadout(machine(), plan(4), Head{}, Line::parse("pnn")); },
                   "\"pnn\" is not in the plan");
    SimulationOptions bad;
    bad.noise.distance = -1.0;
    expect_refused([&] { VirtualReadout(machine(), plan(4), Head{}, Line::parse("ppp"), bad); }, "noise distance");
}
