// The inner loops of bordered_band.cpp, compiled for several instruction sets and chosen at run time. Element (i, j) of
// a matrix is at from[i + j * step]. Rows go in whole vectors: up to 7 more than `rows` are read and written, so they
// must be there, and be zero where they are summed. The order of sums depends on the instruction set alone. Internal.
#pragma once

#include <cstddef>

namespace stepdiag {

inline constexpr std::ptrdiff_t widest_vector = 8;

struct MatrixView {
    double* from;
    std::ptrdiff_t step;
};

struct ConstMatrixView {
    const double* from;
    std::ptrdiff_t step;
    ConstMatrixView(const double* from, std::ptrdiff_t step) : from(from), step(step) {}
    ConstMatrixView(MatrixView m) : from(m.from), step(m.step) {}
};

// b(i, j) at from[i * row_step + j * step].
struct RightFactor {
    const double* from;
    std::ptrdiff_t row_step, step;
};

// C -= A B^T; `columns` of C is a multiple of 6, `inner` is the number of A's columns.
void subtract_product(std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t inner, ConstMatrixView a,
                      RightFactor b, MatrixView c);

// X := X L^-T for six columns X and lower triangular L that has the reciprocals of its diagonal there.
void divide_by_transpose(std::ptrdiff_t rows, ConstMatrixView l, MatrixView x);

// y -= A x and x -= A^T y for six columns A.
void subtract_columns(std::ptrdiff_t rows, ConstMatrixView a, const double* x, double* y);
void subtract_sums(std::ptrdiff_t rows, ConstMatrixView a, const double* y, double* x);

}  // namespace stepdiag
