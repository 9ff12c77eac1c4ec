// Validation of uncertainty propagation by the Monte Carlo method (JCGM 101:2008, clause 8). With the expanded
// uncertainty U = k u of the propagation and the ends y_low, y_high of the probabilistically symmetric coverage
// interval of the Monte Carlo method:
//   d_low = |y - U - y_low|,  d_high = |y + U - y_high|
// The propagation is validated for an output if neither exceeds delta, half a unit of the last significant digit of u.
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
    // For each output, in native units.
    Eigen::VectorXd delta;
    Eigen::VectorXd low, high;  // y - U, y + U
    Eigen::VectorXd d_low, d_high;
    // Standard uncertainty of the ends of the Monte Carlo interval due to the number of samples, for a normal
    // distribution. It should be small compared with delta (JCGM 101, 8.2).
    Eigen::VectorXd sampling;
    std::vector<bool> validated;
    // Reason with figures if the output is not validated; empty otherwise.
    std::vector<std::string> reason;

    std::size_t failures() const;
};

// Uses digits and coverage of the Monte Carlo result. An output with u = 0 from propagation is validated if the Monte
// Carlo method finds only rounding (1e-10 mm, 1e-13 rad). Throws InvalidArgument if the outputs differ.
Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo);
// `digits`: significant digits of u, 1 to 3.
Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo, int digits);

}  // namespace stepdiag
