// The linear maps of the published evaluations for lane_group sets of readings at once: from the lengths and tilts of
// all readings to what evaluate_enhanced and evaluate_conventional determine of them. Weights are those of the passes
// that a map was made of, which must live as long. Internal.
#pragma once

#include <functional>

#include "evaluation/linear_evaluation.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// A number of each lane. Plain loops, which the compiler turns into vectors of the instruction set that the calling
// function is compiled for.
struct LaneRow {
    double lane[lane_group];

    static LaneRow Zero() { return {}; }
    LaneRow& operator+=(const LaneRow& other) {
        for (std::size_t i = 0; i < lane_group; ++i) lane[i] += other.lane[i];
        return *this;
    }
    LaneRow& operator-=(const LaneRow& other) {
        for (std::size_t i = 0; i < lane_group; ++i) lane[i] -= other.lane[i];
        return *this;
    }
    LaneRow& operator*=(double factor) {
        for (double& each : lane) each *= factor;
        return *this;
    }
    friend LaneRow operator+(LaneRow a, const LaneRow& b) { return a += b; }
    friend LaneRow operator-(LaneRow a, const LaneRow& b) { return a -= b; }
    friend LaneRow operator*(double factor, LaneRow a) { return a *= factor; }
    friend LaneRow operator/(LaneRow a, double divisor) { return a *= 1.0 / divisor; }
};

// Writes what is determined, in the order of the tables, to values[parameter * stride + lane].
using LaneMap = std::function<void(const ReadingRows<LaneRow>& readings, double* values, std::size_t stride)>;

LaneMap enhanced_map(const std::vector<Pass>& passes, const Plan& plan, const Chain& chain,
                     const Eigen::Vector3d& tool);
LaneMap conventional_map(const std::vector<Pass>& passes, const Plan& plan);

}  // namespace stepdiag
