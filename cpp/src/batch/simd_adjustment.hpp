// Adjusts many sets of readings at once, one in each lane, each until it converges. Internal: not installed.
#pragma once

#include <memory>
#include <vector>

#include "batch/prepared_adjustment.hpp"
#include "batch/simd_acceleration.hpp"
#include "batch/simd_model.hpp"
#include "batch/simd_solver.hpp"
#include "batch/tilt_effects.hpp"

namespace stepdiag {

// A set has converged when the estimated remaining error of every value is below this part of its standard uncertainty.
inline constexpr double settled_tolerance = 5e-5;

// What all threads read: the problem, its solution for the pattern's readings, and derivatives and factor there.
struct SimdStart {
    PreparedAdjustment pattern;
    std::vector<std::ptrdiff_t> input;         // for each reading of the problem: its place in a set of readings
    std::vector<double> weight;                // the same: 1/u
    std::vector<double> value;                 // the same: the pattern's reading
    std::vector<double> one_over_uncertainty;  // for each value of the tables; 0 for values that are 0 by definition
    std::vector<int> angles;                   // unknowns: of mirrors and lasers
    SimdJacobian jacobian;
    SimdFactor factor;
    TiltEffects tilt_effects;

    SimdStart(const PreparedAdjustment& pattern, const std::vector<std::ptrdiff_t>& input,
              const std::vector<double>& standard_uncertainty);
};

// d value / d reading at the start, by the normal equations: a row for each value, a column for each reading of a set.
Eigen::MatrixXd simd_gain(const SimdStart& start, std::size_t readings);

// Unknowns or readings of lane_group lanes, [index * lane_group + lane].
class SimdNumbers {
public:
    explicit SimdNumbers(Eigen::Index count) : numbers_(count * Eigen::Index(lane_group)) {}
    double* data() { return numbers_.data(); }
    const double* data() const { return numbers_.data(); }
    double* at(Eigen::Index index) { return numbers_.data() + index * Eigen::Index(lane_group); }
    const double* at(Eigen::Index index) const { return numbers_.data() + index * Eigen::Index(lane_group); }
    void fill(const Eigen::VectorXd& same);  // sets all lanes

private:
    AlignedNumbers numbers_;
};

// Steps with constant derivatives J0 and factor of N0 = J0^T J0 + P. Plain chord steps would converge to J0^T r = 0
// instead of J(x)^T r = 0, some hundredths of an uncertainty away; and N0^-1 J(x)^T r diverges, because N0^-1 magnifies
// the part of large residuals that comes from J(x) - J0. Therefore the residuals of the solution are an additional
// unknown s, and a step solves the augmented system (A. Bjorck, BIT 7 (1967) 257)
//   s + ds = r(x) - J0 dx,   J(x)^T s + J0^T ds - P (x + dx) = 0
//   => N0 dx = J0^T (r(x) - s) + J(x)^T s - P x,   s := r(x) - J0 dx.
// Its fixed point is J(x)^T r(x) = P x, the solution of the adjustment. A step reduces the error by a factor of (J -
// J0)/J0. J0 T(x) (tilt_effects.hpp) takes the place of J0: it is nearer to J(x), and with T^T P T = P nearly,
//   N0 T dx = J0^T (r(x) - s) + T^-T (J(x)^T s - P x),   s := r(x) - J0 T dx.
// What T leaves, mainly what angles do to distances of a tilted mirror, acts twice, from x to s and from s to x: two
// steps turn the sign of such an error. Hence steps are accelerated (simd_acceleration.hpp).
class SimdAdjustment {
public:
    explicit SimdAdjustment(const SimdStart& start);

    // Adjusts lane_group sets: from readings[input * stride + lane] to values[value * value_stride + lane]. Gives NaN
    // where a reading is not a number, or no solution is found.
    void adjust(const double* readings, std::size_t stride, double* values, std::size_t value_stride);
    // Takes the first step only.
    void adjust_in_one_step(const double* readings, std::size_t stride, double* values, std::size_t value_stride);

    // For each lane of the last `adjust`: number of steps, and whether full Gauss-Newton steps were needed.
    struct Count {
        int steps;
        bool in_full;
    };
    const std::array<Count, lane_group>& counts() const { return counts_; }

private:
    // The last steps of a lane: the largest change of a value in each, in units of its standard uncertainty, the newest
    // first.
    struct Progress {
        enum State { goes_on, settled, lost, failed } state = goes_on;
        std::array<double, 3> change = {};
        double at_early = 0.0;
        int steps = 0;
        bool recentred = false;

        void add(double largest);
    };
    void begin(const double* readings, std::size_t stride);
    void first_step(const double* readings, std::size_t stride);
    void step(const double* readings, std::size_t stride);
    // Sets that failed once more, from where the first step sees mirrors and lasers, all else being as at the start. At
    // milliradians the second order of these angles sends what is known worst (a head's roll, a lateral offset) far
    // away in the first step, and only that.
    void begin_at_angles(const double* readings, std::size_t stride);
    void take_steps(const double* readings, std::size_t stride, bool has_first);
    void find_square_sum(double* sum) const;
    void accelerate();
    void move(const double* moves);  // lanes where it is not 0
    void recentre(std::size_t lane);
    void put_values(double* values, std::size_t value_stride) const;
    bool has_all_readings(const double* readings, std::size_t stride, std::size_t lane) const;
    void adjust_in_full(const double* readings, std::size_t stride, std::size_t lane);

    const SimdStart& start_;
    SimdModel model_;
    std::unique_ptr<PreparedAdjustment> in_full_;  // created on first use
    SimdNumbers x_, dx_, centre_, s_, r_;
    SimdAcceleration acceleration_;
    std::array<Progress, lane_group> progress_;
    std::array<Count, lane_group> counts_;
};

}  // namespace stepdiag
