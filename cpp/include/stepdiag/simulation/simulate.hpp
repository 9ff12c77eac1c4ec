// The virtual machine and its virtual head: machine + plan + head + misalignments + noise -> Measurement.
// The machine's total error motion moves the mirror before the scene is made; the step-diagonal equations are not used.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "stepdiag/head/head.hpp"
#include "stepdiag/machine/machine.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/optics/medium.hpp"
#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

// Standard deviations of an independent Gaussian per field. The noise of a field depends on the seed, its row and its
// channel only, not on what else is simulated.
struct Noise {
    double distance = 0.0;  // mm; also of d1 ... dn
    double tilt = 0.0;      // rad
    double spot = 0.0;      // mm
    std::uint64_t seed = 0;
};

// Throws InvalidArgument for a deviation that is negative or not finite.
void check_noise(const Noise& noise);

struct SimulationOptions {
    std::map<std::string, Misalignment> misalignment;  // by line name; a line without an entry is aligned
    Noise noise;
    Medium ambient;
};

// Rows: the plan's lines in their order, then its scale lines, points ascending. Lost readings are empty fields. Throws
// InvalidArgument for a head that makes no sense, a mirror smaller than the plan's smallest, misalignments of 0.1 rad
// or more or of lines that are not in the plan, negative noise, an index below 1.
Measurement simulate(const Machine& machine, const Plan& plan, const Head& head, const SimulationOptions& options = {});

}  // namespace stepdiag
