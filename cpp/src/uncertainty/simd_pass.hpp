// A visit's poses traced for `run_lanes` samples at once, one a lane. Numbers of the lanes stand side by side in a
// LaneRow; what is the same in all samples stays one number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/optics/replay.hpp"

namespace stepdiag {

inline constexpr std::size_t run_lanes = lane_group;

struct alignas(64) LaneRow {
    double value[run_lanes];

    void fill(double all) {
        for (double& each : value) each = all;
    }
};

// Numbers of a line's set-up, from which those below are made; rows of its slots (run_model.hpp).
struct LineFrame {
    double frame[9];   // machine_R_line, row by row
    double origin[3];  // of the beam without lateral offset, machine frame, mm
};
// Head and mirror of one line, by lane. `sensor = sensor_R_machine machine + translation`.
struct LaneSetup {
    LaneRow sensor_R_machine[9];
    LaneRow translation[3];
    LaneRow mirror_normal[3];  // in the tool's frame
    LaneRow mirror_axes[6];    // x and y in the sensor frame while the tool stands straight
};
// Angles above 0.1 rad are beyond its series: `followed` becomes 0.
void set_up_lanes(const LineFrame& line, const LaneRow* slots, LaneSetup& setup, std::uint8_t* followed);

// A face on the way, common to all lanes or with rows of its own.
struct LaneFace {
    Event event;
    bool deflects;
    const Outline* outline;
    double plane[12];  // rotation and translation
    double index_before, index_after;
    const LaneRow* plane_rows = nullptr;  // by lane: all of these
    const LaneRow* before_row = nullptr;
    const LaneRow* after_row = nullptr;
    // of the common indices
    double inverse_index = 0.0, index_ratio = 0.0, one_less_ratio2 = 0.0;
};

enum class LaneDetector { ideal, interferometer, spot };

struct LaneBeam {
    std::vector<LaneFace> out, back;  // before and after the mirror; the last one is the detector's
    const LaneRow* source;            // origin, direction
    const LaneRow* air;               // index
    LaneDetector detector;
    double scale = 0.0;     // a distance is scale * (optical length) + offset
    const LaneRow* offset;  // of the distance
    double least_cosine;    // of the returning beam to the axis
    const LaneRow*
        detector_rows;  // interferometer: the axis; spot: two rows of (a, b, c, d), signal = a x + b y + c z + d
    int channel;
};

struct ToolPose {
    double rotation[9];  // machine_R_tool
    double position[3];
};

// What is common to the ways of reading a visit.
struct LaneVisit {
    const ToolPose* poses;
    const LaneRow* displaced = nullptr;  // six rows a pose: shift, rotation vector; none: the same poses in all lanes
    std::size_t rows;
    const LaneSetup* setup;
    std::size_t channels;
    double* readings;           // [(row * channels + channel) * run_lanes + lane]
    LaneRow* excess = nullptr;  // one a row: L tan^2 phi; none: not wanted
    std::uint8_t* followed;     // one a lane: 1 stays 1 where every pose is followed
};

// By replay of the beams' ways, of `most_lane_beams` at most.
inline constexpr std::size_t most_lane_beams = 8;
void trace_lanes(const LaneVisit& visit, const Outline& mirror, const std::vector<LaneBeam>& beams, double gap);

// By the closed definition of a layout's readings: distance and spot, or beams.
struct LaneClosed {
    const LaneRow* index_ratio;   // of the true air to the assumed
    const LaneRow* psd_distance;  // none: beams
    const LaneRow* beams;         // u and v of each, gain included
};
void define_lanes(const LaneVisit& visit, const LaneClosed& closed);

// What a set-up makes of a visit's readings: distances w (d + constant + drift elapsed + model excess) + factor travel,
// and length at the last point; the others gain d + zero.
struct LaneCorrection {
    const double* elapsed;
    const double* travel;
    const double* is_last;
    const LaneRow* constant;  // a row each channel: constant, or zero
    const LaneRow* gain;      // 1 + gain of the channels that are no distances
    const LaneRow* drift;
    const LaneRow* model;
    const LaneRow* wavelength;  // w
    const LaneRow* factor;
    const LaneRow* length;
    const std::uint8_t* is_distance;  // one a channel
};
void correct_lanes(const LaneVisit& visit, const LaneCorrection& correction);

// readings[row * stride + lane] += spread normals[row * run_lanes + lane] + expectation
void add_noise_lanes(const double* normals, std::size_t rows, double spread, double expectation, double* readings,
                     std::size_t stride);

}  // namespace stepdiag
