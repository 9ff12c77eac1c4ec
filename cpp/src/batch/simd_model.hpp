// The adjustment's model for many sets of readings at once, one set a lane: weighted residuals
//   r = (read - model(x))/u  (normal_equations.hpp, channel_model.hpp)
// and J(x)^T s, J = d (model/u) / dx, for given s. Without J: each s goes back through the model as a force, to the
// mirror's pose and from there to each axis' node and to the set-up (reverse differentiation). Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "adjustment/normal_equations.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// Numbers of lanes stand as number[index * lane_group + lane]. After the last unknown there is one more place: 0 in x,
// and without meaning in a gradient. It stands for what is not unknown.
// The problem as plain numbers.
struct SimdProblem {
    struct Channel {
        int reading;           // of the adjustment's problem; no_reading where the pattern has none
        std::ptrdiff_t input;  // which of a set's readings
        double weight;         // 1/u
    };
    struct Point {
        int setup;
        std::array<int, 3> node;  // by place in the chain; home is the last node
        double travel, time;
        int first_channel;
    };
    struct Node {
        std::array<int, 6> unknown;
        std::array<double, 3> position;  // of the axis, as a vector of the machine frame, mm
    };
    struct Setup {
        std::vector<int> unknown;  // by setup::Column
        Eigen::Matrix3d machine_R_line;
        Eigen::Vector3d origin;
        const HeadCalibration* head;
    };
    static constexpr int no_reading = -1;

    HeadLayout kind;
    int unknowns;
    int channels;                           // of a point
    std::array<bool, 3> carries_workpiece;  // by place in the chain
    Eigen::Vector3d tool;
    std::vector<Point> points;
    std::vector<Channel> of_points;
    std::vector<Node> nodes;
    std::vector<Setup> setups;
    int setup_size;  // the largest

    // `input`: by reading of the problem, which of a set's readings it is. The problem must live as long.
    SimdProblem(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input);
};

class SimdModel {
public:
    SimdModel(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input);

    // Numbers by reading of the problem: [reading * lane_group + lane]; a set's readings: readings[input * stride +
    // lane]. Gives r, and J(x)^T s in `pulled`. `is_valid`: by lane, false where a rotation is too large for the series
    // that are summed here (0.1 rad): what is given is then worthless.
    struct At {
        const double* x;
        const double* readings;
        std::size_t stride;
        const double* s;
        double* r;
        double* pulled;
        bool* is_valid;
    };
    void evaluate(const At& at);

private:
    SimdProblem problem_;
    AlignedNumbers scratch_;
};

}  // namespace stepdiag
