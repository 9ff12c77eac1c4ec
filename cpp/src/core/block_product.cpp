#include "core/block_product.hpp"

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "core/block_product.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

using Size = std::ptrdiff_t;

// A tile of C, `Vectors` high and `Columns` wide, stays in registers for the whole sum.
template <int Vectors, int Columns>
STEPDIAG_INLINE void tile(Size inner, ConstMatrixView a, RightFactor b, MatrixView c) {
    const Tag tag;
    const Size width = hn::Lanes(tag);
    Vector sum[Columns][Vectors];
    for (int j = 0; j < Columns; ++j)
        for (int v = 0; v < Vectors; ++v) sum[j][v] = hn::LoadU(tag, c.from + j * c.step + v * width);
    for (Size k = 0; k < inner; ++k) {
        Vector left[Vectors];
        for (int v = 0; v < Vectors; ++v) left[v] = hn::LoadU(tag, a.from + v * width);
        for (int j = 0; j < Columns; ++j) {
            const Vector right = hn::Set(tag, b.from[j * b.row_step]);
            for (int v = 0; v < Vectors; ++v) sum[j][v] = hn::NegMulAdd(left[v], right, sum[j][v]);
        }
        a.from += a.step;
        b.from += b.step;
    }
    for (int j = 0; j < Columns; ++j)
        for (int v = 0; v < Vectors; ++v) hn::StoreU(sum[j][v], tag, c.from + j * c.step + v * width);
}

// All columns of as many rows as `Vectors` hold. A single vector would wait for itself: twelve columns of it.
template <int Vectors>
void stripe(Size columns, Size inner, ConstMatrixView a, RightFactor b, MatrixView c) {
    constexpr int wide = Vectors == 1 ? 12 : 6;
    Size j = 0;
    const auto right = [&]() HWY_ATTR { return RightFactor{b.from + j * b.row_step, b.row_step, b.step}; };
    for (; j + wide <= columns; j += wide) tile<Vectors, wide>(inner, a, right(), {c.from + j * c.step, c.step});
    for (; j < columns; j += 6) tile<Vectors, 6>(inner, a, right(), {c.from + j * c.step, c.step});
}

void subtract_product(Size rows, Size columns, Size inner, ConstMatrixView a, RightFactor b, MatrixView c) {
    constexpr int tallest = HWY_TARGET == HWY_AVX3 ? 3 : 2;  // 32 registers, or 16
    const Size width = hn::Lanes(Tag());
    Size i = 0;
    for (; i + (tallest - 1) * width < rows; i += tallest * width)
        stripe<tallest>(columns, inner, {a.from + i, a.step}, b, {c.from + i, c.step});
    if (tallest == 3 && i + width < rows) stripe<2>(columns, inner, {a.from + i, a.step}, b, {c.from + i, c.step});
    else if (i < rows) stripe<1>(columns, inner, {a.from + i, a.step}, b, {c.from + i, c.step});
}

void divide_by_transpose(Size rows, ConstMatrixView l, MatrixView x) {
    const Tag tag;
    for (Size i = 0; i < rows; i += hn::Lanes(tag)) {
        Vector column[6];
        for (int j = 0; j < 6; ++j) {
            column[j] = hn::LoadU(tag, x.from + i + j * x.step);
            for (int k = 0; k < j; ++k)
                column[j] = hn::NegMulAdd(column[k], hn::Set(tag, l.from[j + k * l.step]), column[j]);
            column[j] = hn::Mul(column[j], hn::Set(tag, l.from[j + j * l.step]));
            hn::StoreU(column[j], tag, x.from + i + j * x.step);
        }
    }
}

void subtract_columns(Size rows, ConstMatrixView a, const double* x, double* y) {
    const Tag tag;
    for (Size i = 0; i < rows; i += hn::Lanes(tag)) {
        Vector sum = hn::LoadU(tag, y + i);
        for (int j = 0; j < 6; ++j)
            sum = hn::NegMulAdd(hn::LoadU(tag, a.from + i + j * a.step), hn::Set(tag, x[j]), sum);
        hn::StoreU(sum, tag, y + i);
    }
}

void subtract_sums(Size rows, ConstMatrixView a, const double* y, double* x) {
    const Tag tag;
    Vector sum[6];
    for (int j = 0; j < 6; ++j) sum[j] = hn::Zero(tag);
    for (Size i = 0; i < rows; i += hn::Lanes(tag)) {
        const Vector right = hn::LoadU(tag, y + i);
        for (int j = 0; j < 6; ++j) sum[j] = hn::MulAdd(hn::LoadU(tag, a.from + i + j * a.step), right, sum[j]);
    }
    for (int j = 0; j < 6; ++j) x[j] -= hn::GetLane(hn::SumOfLanes(tag, sum[j]));
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(subtract_product);
HWY_EXPORT(divide_by_transpose);
HWY_EXPORT(subtract_columns);
HWY_EXPORT(subtract_sums);

}  // namespace

void subtract_product(std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t inner, ConstMatrixView a,
                      RightFactor b, MatrixView c) {
    HWY_DYNAMIC_DISPATCH(subtract_product)(rows, columns, inner, a, b, c);
}

void divide_by_transpose(std::ptrdiff_t rows, ConstMatrixView l, MatrixView x) {
    HWY_DYNAMIC_DISPATCH(divide_by_transpose)(rows, l, x);
}

void subtract_columns(std::ptrdiff_t rows, ConstMatrixView a, const double* x, double* y) {
    HWY_DYNAMIC_DISPATCH(subtract_columns)(rows, a, x, y);
}

void subtract_sums(std::ptrdiff_t rows, ConstMatrixView a, const double* y, double* x) {
    HWY_DYNAMIC_DISPATCH(subtract_sums)(rows, a, y, x);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
