// The virtual machine and its virtual head: machine + plan + head + misalignments + noise -> Measurement. Every pass is
// read by pass_reader.
// The machine's total error motion moves the mirror before the scene is made; the step-diagonal equations are not used.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/core/air.hpp"
#include "stepdiag/head/traced_reading.hpp"
#include "stepdiag/machine/expansion.hpp"
#include "stepdiag/machine/machine.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/plan/run_order.hpp"

namespace stepdiag {

// Standard deviations of an independent Gaussian per field. The noise of a field depends on the seed, its row and its
// channel only, not on the rest of the simulation.
struct Noise {
    double distance = 0.0;  // mm; also of d1 ... dn
    double tilt = 0.0;      // rad
    double spot = 0.0;      // mm
    std::uint64_t seed = 0;
    double common = 0.0;  // mm: one draw a row, added to all of its distances

    // To the signals of a row, by its number in the run.
    void add(SignalRow& row, const std::vector<std::string>& signals, std::uint64_t number) const;
};

// Throws InvalidArgument for a deviation that is negative or not finite.
void check_noise(const Noise& noise);

// The scales of the machine: they expand, and are as warm as this. Makes the channels temperature_x, temperature_y and
// temperature_z, or temperature of one sensor.
struct ScaleTemperatures {
    Expansion expansion;
    Eigen::Vector3d start = Eigen::Vector3d::Constant(20.0);  // by axis, at the run's first reading, degrees Celsius
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();           // K/s
    bool one_sensor = false;                                  // the same for all axes

    Eigen::Vector3d at(double time) const { return start + time * rate; }
};

struct SimulationOptions {
    std::map<std::string, Misalignment> misalignment = {};  // by line name; a line without an entry is aligned
    Noise noise = {};
    std::optional<Environment> environment = {};     // the air that light runs in; none: usual_environment
    std::optional<Environment> assumed = {};         // the air that readings are reduced with; none: the same
    double verified_share = 1e-3;                    // of a traced head's replayed poses (ReplayOptions)
    int repeats = 1;                                 // how often each line is measured; its set-up stays as it is
    bool backward = false;                           // each forward run of a line is followed by a backward run
    std::optional<double> seconds_per_reading = {};  // makes the channel time, which counts from the first reading
    std::optional<ScaleTemperatures> scales = {};    // none: they do not expand, and nothing is recorded
    // Of the functional point along each axis, as if the axis stood further on, since the run's first reading, mm/s.
    Eigen::Vector3d machine_drift = Eigen::Vector3d::Zero();

    static constexpr int largest_repeat_count = 1'000;

    Misalignment misalignment_of(const Line& line) const;
    // What moves the axes along themselves at a commanded position in a row of the run, beside their errors, mm.
    Eigen::Vector3d shift(const Eigen::Vector3d& commanded, std::uint64_t row) const;
    // Whoever says what air is assumed means air; else usual_environment.
    Environment environment_of(const Head& head) const;
    ReadingConditions conditions_of(const Head& head) const;
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

// Rows in the order in which they are read (plan/run_order.hpp). The drift of distances counts from the first reading
// of each forward run. Lost readings are empty fields. Throws InvalidArgument for a head that makes no sense, a mirror
// smaller than the plan's smallest, misalignments of 0.1 rad or more or of lines that are not in the plan, drifts or
// temperatures that change without seconds_per_reading, a gain of a traced multi_beam head, heads of lines that are not
// in the plan, heads that do not give the same signals, negative noise, an index below 1. Throws ReplayMismatch where a
// traced head's replay and its trace differ.
Measurement simulate(const Machine& machine, const Plan& plan, const Heads& heads,
                     const SimulationOptions& options = {}, ReplayCount* count = nullptr);
// Throws InvalidArgument as simulate() does.
void check_run(const Plan& plan, const Heads& heads, const SimulationOptions& options);

// The rows of these passes, in their order, as a measurement, with the records that the options make.
Measurement as_measured(const std::vector<PlannedPass>& passes, const std::vector<std::string>& signals,
                        const std::vector<SignalRow>& rows, const SimulationOptions& options);

}  // namespace stepdiag
