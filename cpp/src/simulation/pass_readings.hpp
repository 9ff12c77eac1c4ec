// The parts of simulate(): the passes of a run, what a head reads on one of them, what its set-up makes of that.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stepdiag/simulation/simulate.hpp"

namespace stepdiag {

// Throw InvalidArgument as simulate() says.
void check_run(const Plan& plan, const Heads& heads, const SimulationOptions& options);
void check_misalignment(const Misalignment& misalignment, const Head& head, const Line& line);
Eigen::Vector2d mirror_size(const Head& head, const Plan& plan);

Misalignment misalignment_of(const SimulationOptions& options, const Line& line);
Environment true_environment(const Head& head, const SimulationOptions& options);
TracedConditions traced_conditions(const Head& head, const SimulationOptions& options);
bool is_distance(const std::string& channel);

// The raw signals of a head at these tool poses: of a design through its reader, of others by their definition.
std::vector<SignalRow> read_traced(const TracedReader& reader, const HeadSetup& setup, const std::vector<Pose>& poses,
                                   std::uint64_t first_row, ReplayCount* count = nullptr);
std::vector<SignalRow> read_defined(Head head, const HeadSetup& setup, const std::vector<Pose>& poses,
                                    const Misalignment& misalignment, const SimulationOptions& options);
// What a line's set-up makes of a row read `elapsed` seconds after its first one.
void add_setup(SignalRow& row, const std::vector<std::string>& channels, const Misalignment& misalignment,
               double elapsed);
// The noise of a row, by its number.
void add_noise(SignalRow& row, const std::vector<std::string>& channels, const Noise& noise, std::uint64_t number);

}  // namespace stepdiag
