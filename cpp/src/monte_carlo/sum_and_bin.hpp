// Inner loops of the statistics, compiled for several instruction sets and selected at run time. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

namespace stepdiag {

// Index of the bin of a value x: 0 for x below `lower`, otherwise 1 + (x - lower) * per_width, at most `last`.
struct BinScale {
    double mean, lower, per_width, last;
};
// Sums of the deviations from the mean and of their squares; lowest and highest value. Not finite if a value is not
// finite.
struct RowSums {
    double first, second, lowest, highest;
};

// Sums and bins for contiguous rows of `samples` values, one row for each output. `samples` is a multiple of
// lane_group. Writes bins[row * stride + sample].
void sum_and_bin(const double* values, std::size_t rows, std::size_t samples, const BinScale* scales, RowSums* sums,
                 std::uint16_t* bins, std::size_t stride);
// The same for any number of samples, one value at a time. Rows of values are `value_stride` apart.
void sum_and_bin_any(const double* values, std::size_t rows, std::size_t samples, std::size_t value_stride,
                     const BinScale* scales, RowSums* sums, std::uint16_t* bins, std::size_t stride);

}  // namespace stepdiag
