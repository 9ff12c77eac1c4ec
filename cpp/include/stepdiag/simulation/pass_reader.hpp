// The one reader of a pass: a head and its mirror, set up on a line, read at poses of the tool. simulate(), the virtual
// readout and the samples of virtual calibrations (uncertainty/scalar_sampler.hpp) all read by it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/head/traced_reading.hpp"
#include "stepdiag/machine/machine.hpp"
#include "stepdiag/plan/run_order.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace stepdiag {

// Where head and mirror stand on a line, before they are misaligned.
struct LinePlace {
    const Head* head;
    Eigen::Matrix3d frame;        // machine_R_line
    Eigen::Vector3d first_point;  // commanded, tool offset included, mm
    Eigen::Vector2d mirror;       // width and height, mm
};
// Throws InvalidArgument for a mirror smaller than the plan's smallest.
LinePlace place_on_line(const Machine& machine, const Plan& plan, const Heads& heads, const Line& line);

// Of the tool, at the points of a pass, as the machine's errors and the scales' expansion have them.
std::vector<Pose> tool_poses(const Machine& machine, const PlannedPass& pass, const SimulationOptions& options);

class PassReader {
public:
    // `head`: that of the place, or what became of it. `traced`: of a head with a design, its optics where somebody has
    // put them together under the same conditions.
    PassReader(Head head, const LinePlace& place, const Misalignment& misalignment, const ReadingConditions& conditions,
               std::shared_ptr<const TracedReader> traced = nullptr);

    // One row a pose, with all that the set-up makes of it and without noise. `elapsed`: seconds since the set-up's
    // first reading, of each pose. `first_row` says which draws the sensors' own noise takes.
    std::vector<SignalRow> read(const std::vector<Pose>& poses, const std::vector<double>& elapsed,
                                std::uint64_t first_row, ReplayCount* count = nullptr) const;

    MirrorPose mirror(const Pose& pose) const { return mirror_in_sensor_frame(setup_, pose.position, pose.rotation); }
    const std::vector<std::string>& signals() const { return signals_; }
    const std::shared_ptr<const TracedReader>& traced() const { return traced_; }

private:
    void add_setup(SignalRow& row, double elapsed) const;

    Head head_;
    std::vector<std::string> signals_;
    Misalignment misalignment_;
    HeadSetup setup_;
    double index_ratio_ = 1.0;                    // of the true air to the assumed; a design's reader knows both
    std::shared_ptr<const TracedReader> traced_;  // of a head with a design
};

}  // namespace stepdiag
