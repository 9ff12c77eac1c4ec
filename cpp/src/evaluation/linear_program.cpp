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

// One block for the lanes of `Vectors` vectors: its sums stay in registers.
template <std::size_t Rows, std::size_t Vectors>
HWY_INLINE void run_block(std::uint32_t terms, const Place& at, double* registers, double* values, std::size_t stride) {
    const Tag tag;
    const std::size_t width = hn::Lanes(tag);
    Vector sum[Rows][Vectors];
    for (std::size_t r = 0; r < Rows; ++r)
        for (std::size_t v = 0; v < Vectors; ++v)
            sum[r][v] = hn::LoadU(tag, registers + at.row[r].base * program_lanes + v * width);
    for (std::uint32_t t = 0; t < terms; ++t) {
        const double* from = registers + at.source[t] * program_lanes;
        Vector value[Vectors];
        for (std::size_t v = 0; v < Vectors; ++v) value[v] = hn::LoadU(tag, from + v * width);
        for (std::size_t r = 0; r < Rows; ++r) {
            const Vector coefficient = hn::Set(tag, at.coefficient[t * Rows + r]);
            for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::MulAdd(value[v], coefficient, sum[r][v]);
        }
    }
    for (std::size_t r = 0; r < Rows; ++r) {
        if (at.row[r].to >= 0)
            for (std::size_t v = 0; v < Vectors; ++v)
                hn::StoreU(sum[r][v], tag, registers + at.row[r].to * program_lanes + v * width);
        if (at.row[r].output >= 0)
            for (std::size_t v = 0; v < Vectors; ++v)
                hn::StoreU(sum[r][v], tag, values + at.row[r].output * stride + v * width);
    }
}

void run_program(const LinearProgram& program, double* registers, double* values, std::size_t stride) {
    constexpr std::size_t vectors = HWY_TARGET == HWY_SCALAR ? 1 : 2;
    const std::size_t width = vectors * hn::Lanes(Tag());
    std::fill_n(registers + program.zero() * program_lanes, program_lanes, 0.0);
    for (std::size_t lane = 0; lane < program_lanes; lane += width) {
        Place at{program.rows(), program.places(), program.coefficients()};
        for (const LinearProgram::Block& block : program.blocks()) {
            if (block.rows == 3) run_block<3, vectors>(block.terms, at, registers + lane, values + lane, stride);
            else if (block.rows == 2) run_block<2, vectors>(block.terms, at, registers + lane, values + lane, stride);
            else run_block<1, vectors>(block.terms, at, registers + lane, values + lane, stride);
            at.row += block.rows;
            at.source += block.terms;
            at.coefficient += block.rows * block.terms;
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
