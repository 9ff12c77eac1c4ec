// The random numbers of virtual calibrations, and the one home of which number is which. All are of the stream
// `virtual_calibration`, with the sample's index as the block's counter, so that a number does not depend on what else
// is drawn. Sequence 0 has the inputs, number i being the input i of UncertainInputs; sequence 1 + e the reading noise
// e, its number r being that of row r (of a walk: of the step from row r - 1). Number m of a sequence s:
//   normal   normal_pair of the block {sample, item = s 2^20 + m / 2, draw 0}, its half m % 2
//   u, v     uniform_pair of the block {sample, item = s 2^20 + m, draw 1}, for distributions that take them
// and what the sensors of a design draw from is the seed 2^53 u of the block {sample, item 0, draw 2}.
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

    // Throws InvalidArgument as check(inputs), and for more kinds of noise than there are sequences.
    Draws(UncertainInputs inputs, std::uint64_t seed);

    const UncertainInputs& what() const { return inputs_; }
    std::uint64_t seed() const { return seed_; }
    Eigen::VectorXd expectations() const;  // of the inputs

    // One sample, one number after the other.
    Eigen::VectorXd inputs(std::uint64_t sample) const;
    double noise(std::size_t entry, std::uint64_t sample, std::size_t row) const;
    std::uint64_t sensor_seed(std::uint64_t sample) const;

    // The same, to a few units in the last place, of `lanes` (a multiple of lane_group) samples in lanes:
    // out[input * lanes + lane], out[(row - first_row) * lanes + lane]; first_row is even, and room for an even number
    // of rows.
    void inputs(std::uint64_t first_sample, std::size_t lanes, double* out) const;
    void noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
               std::size_t rows, double* out) const;
    // The standard normal numbers that noise is made of.
    void standard_noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
                        std::size_t rows, double* out) const;

private:
    UncertainInputs inputs_;
    std::uint64_t seed_;
    std::vector<Eigen::MatrixXd> roots_;  // of the correlations: root root^T = correlation
};

}  // namespace stepdiag
