// Linear maps of the published evaluations for lane_group sets of readings at once: from lengths and tilts of all
// readings to the parameters that evaluate_enhanced and evaluate_conventional determine. Weights are those of the
// passes from which a map was made; the passes must outlive it. Internal.
#pragma once

#include <functional>

#include "evaluation/linear_evaluation.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// One number for each lane, in two of GCC's and Clang's vectors, which stay in registers if the instruction set of the
// calling function has them and are split otherwise.
struct alignas(64) LaneRow {
    using Lanes __attribute__((vector_size(lane_group / 2 * sizeof(double)))) = double;
    Lanes first, second;

    static LaneRow Zero() { return {Lanes{}, Lanes{}}; }
    LaneRow& operator+=(const LaneRow& other) {
        first += other.first, second += other.second;
        return *this;
    }
    LaneRow& operator-=(const LaneRow& other) {
        first -= other.first, second -= other.second;
        return *this;
    }
    LaneRow& operator*=(double factor) {
        first *= factor, second *= factor;
        return *this;
    }
    double* numbers() { return reinterpret_cast<double*>(this); }
    const double* numbers() const { return reinterpret_cast<const double*>(this); }
    friend LaneRow operator+(const LaneRow& a, const LaneRow& b) { return {a.first + b.first, a.second + b.second}; }
    friend LaneRow operator-(const LaneRow& a, const LaneRow& b) { return {a.first - b.first, a.second - b.second}; }
    friend LaneRow operator*(double factor, const LaneRow& a) { return {factor * a.first, factor * a.second}; }
    friend LaneRow operator/(const LaneRow& a, double divisor) { return 1.0 / divisor * a; }
};

// Writes what is determined, in the order of the tables, to values[parameter * stride + lane].
using LaneMap = std::function<void(const ReadingRows<LaneRow>& readings, double* values, std::size_t stride)>;

LaneMap enhanced_map(const std::vector<Pass>& passes, const Plan& plan, const Chain& chain,
                     const Eigen::Vector3d& tool);
LaneMap conventional_map(const std::vector<Pass>& passes, const Plan& plan);

}  // namespace stepdiag
