#include "evaluation/linear_program.hpp"

#include <algorithm>

// Not those instruction sets that differ from another one only in what is not used here.
#include <hwy/detect_targets.h>
#undef HWY_DISABLED_TARGETS
#ifdef HWY_AVX3_ZEN4  // since Highway 1.1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_AVX3_ZEN4 | HWY_AVX3_SPR)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "evaluation/linear_program.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

// Where the program has come to.
struct Place {
    const LinearProgram::Row* row;
    const std::uint32_t* source;
    const double* coefficient;
};

// Blocks of one shape for the lanes of `Vectors` vectors: sums stay in registers.
template <std::size_t Rows, bool OfDifferences, std::size_t Vectors>
HWY_INLINE void run_blocks(const LinearProgram::Blocks& blocks, Place& at, double* registers, double* values,
                           std::size_t stride) {
    const Tag tag;
    const std::size_t width = hn::Lanes(tag);
    const auto load = [&](std::size_t place, std::size_t v)
                          HWY_ATTR { return hn::LoadU(tag, registers + place * program_lanes + v * width); };
    const std::uint32_t terms = blocks.shape.terms;
    for (std::uint32_t block = 0; block < blocks.count; ++block) {
        Vector sum[Rows][Vectors];
        for (std::size_t r = 0; r < Rows; ++r)
            for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::Zero(tag);
        for (std::uint32_t t = 0; t < terms; ++t) {
            Vector value[Vectors];
            for (std::size_t v = 0; v < Vectors; ++v)
                value[v] =
                    OfDifferences ? hn::Sub(load(at.source[0], v), load(at.source[1], v)) : load(at.source[0], v);
            for (std::size_t r = 0; r < Rows; ++r) {
                const Vector coefficient = hn::Set(tag, at.coefficient[r]);
                for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::MulAdd(value[v], coefficient, sum[r][v]);
            }
            at.source += OfDifferences ? 2 : 1;
            at.coefficient += Rows;
        }
        for (std::size_t r = 0; r < Rows; ++r, ++at.row) {
            // The base comes last: of a running sum it is what has to be waited for.
            for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::Add(sum[r][v], load(at.row->base, v));
            if (at.row->to >= 0)
                for (std::size_t v = 0; v < Vectors; ++v)
                    hn::StoreU(sum[r][v], tag, registers + at.row->to * program_lanes + v * width);
            if (at.row->output >= 0)
                for (std::size_t v = 0; v < Vectors; ++v)
                    hn::StoreU(sum[r][v], tag, values + at.row->output * stride + v * width);
        }
    }
}

template <bool OfDifferences, std::size_t Vectors>
HWY_INLINE void run_blocks_of(const LinearProgram::Blocks& blocks, Place& at, double* registers, double* values,
                              std::size_t stride) {
    if (blocks.shape.rows == 3) run_blocks<3, OfDifferences, Vectors>(blocks, at, registers, values, stride);
    else if (blocks.shape.rows == 2) run_blocks<2, OfDifferences, Vectors>(blocks, at, registers, values, stride);
    else run_blocks<1, OfDifferences, Vectors>(blocks, at, registers, values, stride);
}

void run_program(const LinearProgram& program, double* registers, double* values, std::size_t stride) {
    constexpr std::size_t vectors = HWY_TARGET == HWY_SCALAR ? 1 : 2;
    const std::size_t width = vectors * hn::Lanes(Tag());
    std::fill_n(registers + program.zero() * program_lanes, program_lanes, 0.0);
    for (std::size_t lane = 0; lane < program_lanes; lane += width) {
        Place at{program.rows(), program.places(), program.coefficients()};
        for (const LinearProgram::Blocks& blocks : program.blocks()) {
            if (blocks.shape.of_differences)
                run_blocks_of<true, vectors>(blocks, at, registers + lane, values + lane, stride);
            else run_blocks_of<false, vectors>(blocks, at, registers + lane, values + lane, stride);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(run_program);

}  // namespace

void LinearProgram::run(double* registers, double* values, std::size_t stride) const {
    HWY_DYNAMIC_DISPATCH(run_program)(*this, registers, values, stride);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
