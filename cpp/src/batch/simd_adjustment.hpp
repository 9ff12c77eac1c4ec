// The adjustment of many sets of readings at once, one a lane, each converged. Internal: not installed.
#pragma once

#include <memory>
#include <vector>

#include "batch/prepared_adjustment.hpp"
#include "batch/simd_model.hpp"
#include "batch/simd_solver.hpp"

namespace stepdiag {

// What is left of a solution, by the steps that led there, as a part of each value's standard uncertainty: converged.
inline constexpr double settled_tolerance = 5e-5;

// What all threads read: the problem, its solution for the pattern's readings, derivatives and factor there.
struct SimdStart {
    PreparedAdjustment pattern;
    std::vector<std::ptrdiff_t> input;         // by reading of the problem: which of a set's readings
    std::vector<double> weight;                // likewise: 1/u
    std::vector<double> value;                 // likewise: the pattern's
    std::vector<double> one_over_uncertainty;  // by value of the tables; 0 of those that are 0 by definition
    SimdJacobian jacobian;
    SimdFactor factor;

    SimdStart(const PreparedAdjustment& pattern, const std::vector<std::ptrdiff_t>& input,
              const std::vector<double>& standard_uncertainty);
};

// d value / d reading at the start, readings being those of a set: values x readings, from the normal equations.
Eigen::MatrixXd simd_gain(const SimdStart& start, std::size_t readings);

// Unknowns or readings of lane_group lanes, [index * lane_group + lane].
class SimdNumbers {
public:
    explicit SimdNumbers(Eigen::Index count) : numbers_(count * Eigen::Index(lane_group)) {}
    double* data() { return numbers_.data(); }
    const double* data() const { return numbers_.data(); }
    double* at(Eigen::Index index) { return numbers_.data() + index * Eigen::Index(lane_group); }
    const double* at(Eigen::Index index) const { return numbers_.data() + index * Eigen::Index(lane_group); }
    void fill(const Eigen::VectorXd& same);  // in all lanes

private:
    AlignedNumbers numbers_;
};

// Steps with derivatives J0 and factor as they are at the start, N0 = J0^T J0 + P. Plain chord steps would end where
// J0^T r = 0, not J(x)^T r = 0, some hundredths of an uncertainty away, and N0^-1 J(x)^T r diverges, because N0^-1
// magnifies what J(x) - J0 makes of large residuals. So the residuals of the solution are an unknown s beside x, and a
// step solves the augmented system (A. Bjorck, BIT 7 (1967) 257)
//   s + ds = r(x) - J0 dx,   J(x)^T s + J0^T ds - P (x + dx) = 0
//   => N0 dx = J0^T (r(x) - s) + J(x)^T s - P x,   s := r(x) - J0 dx,
// which is at rest where J(x)^T r(x) = P x: at the adjustment's own solution, by a factor of (J - J0)/J0 a step.
class SimdAdjustment {
public:
    explicit SimdAdjustment(const SimdStart& start);

    // Of lane_group sets, readings[input * stride + lane]: values[value * value_stride + lane]; NaN where a reading is
    // no number or no solution is found.
    void adjust(const double* readings, std::size_t stride, double* values, std::size_t value_stride);
    // The first step alone.
    void adjust_in_one_step(const double* readings, std::size_t stride, double* values, std::size_t value_stride);

    // Of the last `adjust`, by lane: steps, and whether they had to be full Gauss-Newton steps.
    struct Count {
        int steps;
        bool in_full;
    };
    const std::array<Count, lane_group>& counts() const { return counts_; }

private:
    // How the steps of a lane went: the largest change of a value, in its standard uncertainty, the last one first.
    struct Progress {
        enum State { goes_on, settled, lost, failed } state = goes_on;
        std::array<double, 3> change = {};
        double at_early = 0.0;
        int steps = 0;
        bool recentred = false;

        void add(double largest);
    };
    void begin();
    void step(const double* readings, std::size_t stride);
    void find_changes(double* largest) const;
    void find_square_sum(double* sum) const;
    void move();
    void recentre(std::size_t lane);
    void put_values(double* values, std::size_t value_stride) const;
    bool has_all_readings(const double* readings, std::size_t stride, std::size_t lane) const;
    void adjust_in_full(const double* readings, std::size_t stride, std::size_t lane);

    const SimdStart& start_;
    SimdModel model_;
    std::unique_ptr<PreparedAdjustment> in_full_;  // made where it is needed first
    SimdNumbers x_, dx_, centre_, s_, r_, difference_;
    std::array<Progress, lane_group> progress_;
    std::array<Count, lane_group> counts_;
};

}  // namespace stepdiag
