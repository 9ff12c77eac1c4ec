// The inner loops of statistics, compiled for several instruction sets and chosen at run time. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

namespace stepdiag {

// Bin of a value x: 0 below `lower`, else 1 + (x - lower) * per_width, at most `last`.
struct BinScale {
    double mean, lower, per_width, last;
};
// About the mean: sums of deviations and of their squares; lowest and highest value. Not finite where a value is not.
struct RowSums {
    double first, second, lowest, highest;
};

// Rows of `samples` values (a multiple of lane_group), one an output, one after the other: sums and bins of each row;
// bins[row * stride + sample].
void sum_and_bin(const double* values, std::size_t rows, std::size_t samples, const BinScale* scales, RowSums* sums,
                 std::uint16_t* bins, std::size_t stride);
// The same for any number of samples, value by value; rows of values have the same stride of their own.
void sum_and_bin_any(const double* values, std::size_t rows, std::size_t samples, std::size_t value_stride,
                     const BinScale* scales, RowSums* sums, std::uint16_t* bins, std::size_t stride);

}  // namespace stepdiag
