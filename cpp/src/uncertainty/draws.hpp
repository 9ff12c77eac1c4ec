// Random numbers of virtual calibrations. This file defines their addresses. All numbers are from the stream
// `virtual_calibration`, with the sample's index as the counter of the block, so that a number does not depend on other
// draws. Sequence 0 contains the inputs: number i is input i of UncertainInputs. Sequence 1 + e contains the reading
// noise e: number r belongs to row r (for a walk: to the step from row r - 1). Number m of sequence s uses
//   normal   normal_pair of the block {sample, item = s 2^20 + m / 2, draw 0}, its half m % 2
//   u, v     uniform_pair of the block {sample, item = s 2^20 + m, draw 1}, for distributions that need them
// The sensors of a design use the seed 2^53 u of the block {sample, item 0, draw 2}.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stepdiag/uncertainty/inputs.hpp"

namespace stepdiag {

class Draws {
public:
    static constexpr std::uint32_t items_of_a_sequence = 1u << 20;
    static constexpr std::size_t most_rows = 2 * std::size_t(items_of_a_sequence);
    static constexpr std::size_t most_sequences = (std::size_t(1) << 32) / items_of_a_sequence;

    // Throws InvalidArgument as check(inputs), and for too many inputs or kinds of noise.
    Draws(UncertainInputs inputs, std::uint64_t seed);

    const UncertainInputs& what() const { return inputs_; }
    std::uint64_t seed() const { return seed_; }
    Eigen::VectorXd expectations() const;  // of the inputs

    // Numbers of one sample.
    Eigen::VectorXd inputs(std::uint64_t sample) const;
    double noise(std::size_t entry, std::uint64_t sample, std::size_t row) const;
    std::uint64_t sensor_seed(std::uint64_t sample) const;

    // The same for many samples with SIMD, equal to a few units in the last place. `lanes` is the number of samples, a
    // multiple of lane_group. Writes out[input * lanes + lane] and out[(row - first_row) * lanes + lane]. first_row
    // must be even; `out` has room for an even number of rows.
    void inputs(std::uint64_t first_sample, std::size_t lanes, double* out) const;
    void noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
               std::size_t rows, double* out) const;
    // Standard normal numbers before the transformation to the noise's distribution.
    void standard_noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
                        std::size_t rows, double* out) const;

private:
    UncertainInputs inputs_;
    std::uint64_t seed_;
    std::vector<Eigen::MatrixXd> roots_;  // for each correlation: root root^T = correlation
};

}  // namespace stepdiag
