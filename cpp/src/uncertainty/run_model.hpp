// What all samples of a virtual run share: its rows, what stands where nominally, and which input acts on what.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "stepdiag/simulation/pass_reader.hpp"
#include "stepdiag/uncertainty/virtual_calibration.hpp"
#include "uncertainty/draws.hpp"

namespace stepdiag {

// The numbers that all lines share.
namespace shared_field {
enum : int {
    reading_model = 0,
    temperature = 1,
    pressure = 2,
    humidity = 3,
    refractive_index = 4,
    wavelength = 5,
    machine_drift = 6,  // x, y, z, as the next two
    expansion = 9,
    scale_temperature = 12,
    scale_ramp = 15,
    psd_distance = 18,
    beam_offset = 19,  // u, v of d1 ... dn
};
}

// The input `input` adds to the number in the field `field`.
struct Deviating {
    int field;
    int input;
};
// Numbers of a line's set-up (setup::Column), or shared ones.
struct Fields {
    std::vector<double> nominal;
    std::vector<Deviating> uncertain;

    bool is_uncertain(int first, int count = 1) const;
    // Not what it would be in a run without errors.
    bool acts(int first, int count = 1) const;
    std::vector<double> with(const Eigen::VectorXd& deviations) const;
};
// An input that moves a component of a design: `number` 0, 1, 2 shifts it, 3, 4, 5 turns it.
struct MovedPart {
    std::string component;
    int number;
    int input;
};

struct RunRow {
    double elapsed;       // s, since the first reading of its set-up
    double travel;        // mm, commanded, along the line from its first point
    double length_share;  // of a length standard's error: 1 at the last point, along a scale line as the travel
    // By axis: kelvins above the reference temperature, and mm from the scale's fixed point.
    Eigen::Vector3d warmth = Eigen::Vector3d::Zero(), from_fixed = Eigen::Vector3d::Zero();
};

struct RunPass {
    PlannedPass planned;
    LinePlace place;

    std::size_t first_row() const { return std::size_t(planned.first_row); }
    std::size_t rows() const { return planned.points.size(); }
};

struct NoiseTerm {
    std::size_t entry;             // of UncertainInputs::noise
    int channel;                   // of channel noise
    double spread_per_step = 1.0;  // of walks: sqrt(s)
};

// Throws InvalidArgument as VirtualCalibrations.
struct RunModel {
    RunModel(const VirtualRun& run, std::uint64_t seed);
    RunModel(const RunModel&) = delete;

    const VirtualRun run;
    const Draws draws;
    double seconds;
    std::vector<std::string> channels;
    int beams;  // d1 ... dn
    std::vector<RunPass> passes;
    std::vector<RunRow> rows;
    std::vector<Pose> poses;    // nominal tool, by row
    std::vector<Fields> lines;  // by line_index
    Fields shared;
    std::vector<MovedPart> moved_parts;

    bool has(NoiseQuantity quantity) const;
    bool moves_poses() const;  // something displaces the tool by sample
    bool has_uncertain_scales() const;
    // What an axis moves by in this row where its coefficient and its temperature are by so much other than stated. The
    // turn of the axis's direction by other axes' rotations is left out: a part of 1e-4.
    double moved_by_scale(const RunRow& row, int axis, double expansion, double temperature) const {
        const double stated = run.simulation.scales->expansion.coefficient[axis];
        return ((stated + expansion) * (row.warmth[axis] + temperature) - stated * row.warmth[axis]) *
               row.from_fixed[axis];
    }
    bool has_uncertain_air() const;

    // Of one head, at these numbers of the shared fields.
    Environment environment(const Head& head, const std::vector<double>& shared_numbers) const;
    Environment assumed(const Head& head) const;
    Head head(const Head& nominal, const std::vector<double>& shared_numbers, const Eigen::VectorXd& deviations) const;

private:
    void add_input(const UncertainInput& input, int index);
    void check_noises() const;
};

}  // namespace stepdiag
