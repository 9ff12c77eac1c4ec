#include "stepdiag/simulation/virtual_readout.hpp"

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

PassReader reader_on(const Machine& machine, const Plan& plan, const Heads& heads, const Line& line,
                     SimulationOptions options) {
    if (!options.seconds_per_reading) options.seconds_per_reading = 1.0;  // the caller states the time of each reading
    check_run(plan, heads, options);
    if (!plan.contains(line)) throw InvalidArgument("line: \"" + line.name() + "\" is not in the plan");
    const LinePlace place = place_on_line(machine, plan, heads, line);
    return {*place.head, place, options.misalignment_of(line), options.conditions_of(*place.head)};
}

}  // namespace

VirtualReadout::VirtualReadout(Machine machine, const Plan& plan, const Heads& heads, const Line& line,
                               SimulationOptions options)
    : machine_(std::move(machine)),
      options_(std::move(options)),
      reader_(reader_on(machine_, plan, heads, line, options_)) {}

SignalRow VirtualReadout::read(const Eigen::Vector3d& position, const Approaches& approach, std::uint64_t row,
                               double elapsed) const {
    const Pose pose = machine_.pose(position, approach, options_.shift(position, row));
    SignalRow signals = reader_.read({pose}, {elapsed}, row).front();
    options_.noise.add(signals, reader_.signals(), row);
    return signals;
}

}  // namespace stepdiag
