// Validation of propagation by the Monte Carlo method (JCGM 101, 8): with U = k u of propagation, and the ends of the
// probabilistically symmetric coverage interval of the Monte Carlo method,
//   d_low = |y - U - y_low|,  d_high = |y + U - y_high|
// propagation is validated for an output where neither exceeds delta, half a unit of the last significant digit of u.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "stepdiag/monte_carlo/monte_carlo.hpp"
#include "stepdiag/uncertainty/propagation.hpp"

namespace stepdiag {

struct Validation {
    std::vector<SampleModel::Output> outputs;
    double coverage;
    int digits;
    // By output, native units.
    Eigen::VectorXd delta;
    Eigen::VectorXd low, high;  // y - U, y + U
    Eigen::VectorXd d_low, d_high;
    // Standard uncertainty of the Monte Carlo interval's ends by the number of samples (of a normal distribution). JCGM
    // 101 (8.2) wants it small beside delta.
    Eigen::VectorXd sampling;
    std::vector<bool> validated;
    // Where it is not validated: why, in words with figures; empty elsewhere.
    std::vector<std::string> reason;

    std::size_t failures() const;
};

// Digits and coverage are those of the Monte Carlo result. An output without uncertainty by propagation is validated
// where the Monte Carlo method finds none but rounding (1e-10 mm, 1e-13 rad). Throws InvalidArgument for results of
// other outputs.
Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo);
// `digits` of u, 1 to 3.
Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo, int digits);

}  // namespace stepdiag
