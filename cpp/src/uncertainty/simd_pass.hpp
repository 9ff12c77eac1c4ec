// A pass's poses traced for `lane_group` samples at once, one a lane. Numbers of the lanes stand side by side in a
// SimdRow; what is the same in all samples stays one number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/measurement/head_layout.hpp"
#include "stepdiag/optics/replay.hpp"
#include "uncertainty/plates.hpp"

namespace stepdiag {

struct alignas(64) SimdRow {
    double value[lane_group];

    void fill(double all) {
        for (double& each : value) each = all;
    }
};

// Numbers of a line's set-up, from which those below are made; rows of its fields (run_model.hpp).
struct LineFrame {
    double frame[9];   // machine_R_line, row by row
    double origin[3];  // of the beam without lateral offset, machine frame, mm
};
// Head and mirror of one line, by lane. `sensor = sensor_R_machine machine + translation`.
struct SimdSetup {
    SimdRow sensor_R_machine[9];
    SimdRow translation[3];
    SimdRow mirror_normal[3];  // in the tool's frame
    SimdRow mirror_axes[6];    // x and y in the sensor frame while the tool stands straight
};
// Angles above 0.1 rad are beyond its series: `followed` becomes 0.
void set_up_pass(const LineFrame& line, const SimdRow* fields, SimdSetup& setup, std::uint8_t* followed);

// A face on the way, common to all lanes or with rows of its own.
struct SimdFace {
    Event event;
    bool deflects;
    const Outline* outline;
    double plane[12];  // rotation and translation
    double index_before, index_after;
    const SimdRow* plane_rows = nullptr;  // by lane: all of these
    const SimdRow* before_row = nullptr;
    const SimdRow* after_row = nullptr;
    // of the common indices
    double inverse_index = 0.0, index_ratio = 0.0, one_less_ratio2 = 0.0;
};

enum class SimdDetector { interferometer, spot };

struct SimdBeam {
    std::vector<SimdFace> out, back;  // before the mirror, and after the mirror and `plates`; at last the detector's
    const Plates* plates = nullptr;   // first behind the mirror; none: all faces are in `back`
    const SimdRow* source;            // origin, direction
    const SimdRow* air;               // index
    SimdDetector detector;
    double scale = 0.0;     // a distance is scale * (optical length) + offset
    const SimdRow* offset;  // of the distance
    double least_cosine;    // of the returning beam to the axis
    const SimdRow*
        detector_rows;  // interferometer: the axis; spot: two rows of (a, b, c, d), signal = a x + b y + c z + d
    int channel;
};

struct ToolPose {
    double rotation[9];  // machine_R_tool
    double position[3];
};

// What is common to both ways of reading a pass.
struct SimdPass {
    const ToolPose* poses;
    const SimdRow* displaced = nullptr;  // three rows a pose; none: the same poses in all lanes
    const SimdRow* turned = nullptr;     // rotation vectors, the same way
    std::size_t rows;
    const SimdSetup* setup;
    std::size_t channels;
    double* readings;           // [(row * channels + channel) * lane_group + lane]
    SimdRow* excess = nullptr;  // one a row: L tan^2 phi; none: not wanted
    std::uint8_t* followed;     // one a lane: 1 stays 1 where every pose is followed
};

// By replay of the beams' ways, of `most_simd_beams` at most.
inline constexpr std::size_t most_simd_beams = 8;
void trace_pass(const SimdPass& pass, const Outline& mirror, const std::vector<SimdBeam>& beams, double gap);

// By the closed definition of a layout's readings, with the rules of define_signals (head/head.hpp).
struct SimdClosed {
    HeadLayout layout;
    const SimdRow* index_ratio;   // of the true air to the assumed
    const SimdRow* psd_distance;  // layout psd
    const SimdRow* beams;         // layout multi_beam: u and v of each, gain included
    Eigen::Vector2d half_mirror;  // a mirror of this size at most, as it does not turn with the tool
    double aperture;
};
void define_pass(const SimdPass& pass, const SimdClosed& closed);

// What a set-up makes of a pass's readings: distances w (d + constant + drift elapsed + model excess) + factor travel,
// and length at the last point; the others gain d + zero.
struct SimdCorrection {
    const double* elapsed;
    const double* travel;
    const double* length_share;
    const SimdRow* constant;  // a row each channel: constant, or zero
    const SimdRow* gain;      // 1 + gain of the channels that are no distances
    const SimdRow* drift;
    const SimdRow* model;
    const SimdRow* wavelength;  // w
    const SimdRow* factor;
    const SimdRow* length;
    const std::uint8_t* is_distance;  // one a channel
};
void correct_pass(const SimdPass& pass, const SimdCorrection& correction);

// readings[row * stride + lane] += spread normals[row * lane_group + lane] + expectation
void add_noise_to_pass(const double* normals, std::size_t rows, double spread, double expectation, double* readings,
                       std::size_t stride);

}  // namespace stepdiag
