#include "stepdiag/simulation/virtual_readout.hpp"

#include "simulation/pass_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

VirtualReadout::VirtualReadout(Machine machine, const Plan& plan, const Heads& heads, const Line& line,
                               SimulationOptions options)
    : machine_(std::move(machine)), options_(std::move(options)) {
    if (!options_.seconds_per_reading) options_.seconds_per_reading = 1.0;  // who reads says what time has gone by
    check_run(plan, heads, options_);
    if (!plan.contains(line)) throw InvalidArgument("line: \"" + line.name() + "\" is not in the plan");
    head_ = heads.of(line);
    misalignment_ = misalignment_of(options_, line);
    check_misalignment(misalignment_, head_, line);
    const Eigen::Vector2d mirror = mirror_size(head_, plan);
    setup_ =
        set_up(head_, plan.frame(line), plan.points(line).front().commanded + machine_.tool(), mirror, misalignment_);
    if (head_.design) reader_.emplace(head_, mirror, traced_conditions(head_, options_));
}

SignalRow VirtualReadout::read(const Eigen::Vector3d& position, const Approaches& approach, std::uint64_t row,
                               double elapsed) const {
    const std::vector<Pose> poses = {machine_.pose(position, approach)};
    const std::vector<std::string> names = signal_names(head_);
    SignalRow signals = reader_ ? read_traced(*reader_, setup_, poses, row).front()
                                : read_defined(head_, setup_, poses, misalignment_, options_).front();
    add_setup(signals, names, misalignment_, elapsed);
    add_noise(signals, names, options_.noise, row);
    return signals;
}

}  // namespace stepdiag
