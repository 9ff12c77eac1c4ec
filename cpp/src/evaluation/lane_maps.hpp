// Linear maps of the published evaluations for lane_group sets of readings at once: from lengths and tilts of all
// readings to the parameters that evaluate_enhanced and evaluate_conventional determine. Weights are those of the
// passes from which a map was made; the passes must outlive it. Internal.
#pragma once

#include <functional>

#include "evaluation/linear_evaluation.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// One number for each lane. The compiler vectorises the plain loops for the instruction set of the calling function.
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
