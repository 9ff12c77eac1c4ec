// The virtual machine and its virtual head: machine + plan + head + misalignments + noise -> Measurement.
// The machine's total error motion moves the mirror before the scene is made; the step-diagonal equations are not used.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "stepdiag/head/traced_reading.hpp"
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
    double common = 0.0;  // mm: one draw a row, added to all of its distances
};

// Throws InvalidArgument for a deviation that is negative or not finite.
void check_noise(const Noise& noise);

struct SimulationOptions {
    std::map<std::string, Misalignment> misalignment = {};  // by line name; a line without an entry is aligned
    Noise noise = {};
    std::optional<Environment> environment = {};  // the air that light runs in; none: usual_environment
    std::optional<Environment> assumed = {};      // the air that readings are reduced with; none: the same
    double verified_share = 1e-3;                 // of a traced head's replayed poses (ReplayOptions)
};

// The heads of a run's lines. All of them give the same signals.
struct Heads {
    Head head;
    std::map<std::string, Head> by_line = {};  // of the lines that have another one

    Heads(Head head = {}, std::map<std::string, Head> by_line = {})
        : head(std::move(head)), by_line(std::move(by_line)) {}
    const Head& of(const Line& line) const;
    HeadCalibrations calibration() const;
};

// Rows: the plan's lines in their order, then its scale lines, points ascending. Lost readings are empty fields. Throws
// InvalidArgument for a head that makes no sense, a mirror smaller than the plan's smallest, misalignments of 0.1 rad
// or more or of lines that are not in the plan, heads of such lines, heads that do not give the same signals, negative
// noise, an index below 1. Throws ReplayMismatch where a traced head's replay and its trace differ.
Measurement simulate(const Machine& machine, const Plan& plan, const Heads& heads,
                     const SimulationOptions& options = {}, ReplayCount* count = nullptr);

}  // namespace stepdiag
