// The adjustment's model for many sets of readings at once, one in each lane. Computes weighted residuals
//   r = (read - model(x))/u  (normal_equations.hpp, channel_model.hpp)
// and, for given s, the product J(x)^T s with J = d (model/u) / dx. J itself is not formed (reverse differentiation):
// each s is a force on a reading, which is carried back to the mirror's pose, and from there to the nodes of the axes
// and to the set-up. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "adjustment/normal_equations.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// The problem as plain numbers. Numbers of lanes are stored as number[index * lane_group + lane]. One additional place
// after the last unknown stands for quantities that are not unknown: it is 0 in x, and meaningless in a gradient.
struct SimdProblem {
    struct Channel {
        int reading;           // index in the adjustment's problem; no_reading if the pattern has none
        std::ptrdiff_t input;  // place in a set of readings
        double weight;         // 1/u
    };
    struct Point {
        int setup;
        std::array<int, 3> node;  // for each place in the chain; home is the last node
        double travel, time, drifted;
        int first_channel;
        std::array<double, 3> expansion, stretch;  // of each axis along itself, mm; by its coefficient, mm K
    };
    struct Coefficient {
        int unknown;
        std::vector<int> axes;
        bool of_drift;

        double effect(const Point& point, int axis) const { return of_drift ? point.drifted : point.stretch[axis]; }
    };
    struct Node {
        std::array<int, 6> unknown;
        std::array<double, 3> position;  // of the axis, as a vector in the machine frame, mm
    };
    struct Setup {
        std::vector<int> unknown;  // for each setup::Column
        Eigen::Matrix3d machine_R_line;
        Eigen::Vector3d origin;
        const HeadCalibration* head;
    };
    static constexpr int no_reading = -1;

    HeadLayout kind;
    int unknowns;
    int channels;                           // per point
    std::array<bool, 3> carries_workpiece;  // for each place in the chain
    std::array<int, 3> axis;                // likewise: 0, 1, 2
    Eigen::Vector3d tool;
    bool moves_axes;  // along themselves, by more than their errors
    std::vector<Coefficient> coefficients;
    std::vector<Point> points;
    std::vector<Channel> of_points;
    std::vector<Node> nodes;
    std::vector<Setup> setups;
    int setup_size;  // largest number of set-up unknowns

    // `input`: for each reading of the problem, its place in a set of readings. The problem must outlive this object.
    SimdProblem(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input);
};

class SimdModel {
public:
    SimdModel(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input);

    // Residuals r and forces s are stored as [reading * lane_group + lane], with readings of the problem; the readings
    // of the sets as readings[input * stride + lane]. Computes r, and J(x)^T s in `pulled`. `is_valid`, for each lane:
    // false if a rotation is too large for the series used here (0.1 rad); the results are then meaningless.
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
