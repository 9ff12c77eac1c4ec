// The virtual head set up on one line, read with the axes at any position: the row that simulate() makes there.
// For whoever moves the virtual machine himself: a simulator of an instrument, behind a real controller.
#pragma once

#include <cstdint>

#include "stepdiag/simulation/pass_reader.hpp"

namespace stepdiag {

class VirtualReadout {
public:
    // Head and mirror as simulate() places them on `line`. Throws InvalidArgument as simulate() does, and for a line
    // that is not in the plan; a drift needs no seconds_per_reading here.
    VirtualReadout(Machine machine, const Plan& plan, const Heads& heads, const Line& line,
                   SimulationOptions options = {});

    // One value a signal, in the order of signal_names; lost ones are empty. `row` says which draws the noise takes, as
    // the number of a simulated row does, and how warm the scales are; `elapsed`: seconds since the set-up's first
    // reading, which its drift counts.
    SignalRow read(const Eigen::Vector3d& position, const Approaches& approach = all_positive, std::uint64_t row = 0,
                   double elapsed = 0.0) const;

private:
    Machine machine_;
    SimulationOptions options_;
    PassReader reader_;
};

}  // namespace stepdiag
