#include "monte_carlo/sum_and_bin.hpp"

#include <algorithm>
#include <limits>

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "monte_carlo/sum_and_bin.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

STEPDIAG_INLINE RowSums row(const double* values, std::size_t samples, const BinScale& scale, std::uint16_t* bins) {
    const Tag tag;
    const hn::Rebind<std::int32_t, Tag> integers;
    const hn::Rebind<std::uint16_t, Tag> indices;
    const auto mean = hn::Set(tag, scale.mean), lower = hn::Set(tag, scale.lower);
    const auto per_width = hn::Set(tag, scale.per_width), last = hn::Set(tag, scale.last);
    const auto zero = hn::Zero(tag), one = hn::Set(tag, 1.0);
    auto first = zero, second = zero;
    auto lowest = hn::Set(tag, std::numeric_limits<double>::infinity());
    auto highest = hn::Neg(lowest);
    for (std::size_t i = 0; i < samples; i += hn::Lanes(tag)) {
        const auto value = hn::LoadU(tag, values + i);
        const auto deviation = hn::Sub(value, mean);
        first = hn::Add(first, deviation);
        second = hn::MulAdd(deviation, deviation, second);
        lowest = hn::Min(lowest, value);
        highest = hn::Max(highest, value);
        const auto place = hn::MulAdd(hn::Sub(value, lower), per_width, one);
        const auto bin = hn::Min(hn::Max(place, zero), last);
        hn::StoreU(hn::DemoteTo(indices, hn::DemoteTo(integers, bin)), indices, bins + i);
    }
    return {hn::GetLane(hn::SumOfLanes(tag, first)), hn::GetLane(hn::SumOfLanes(tag, second)),
            hn::GetLane(hn::MinOfLanes(tag, lowest)), hn::GetLane(hn::MaxOfLanes(tag, highest))};
}

void rows_of_block(const double* values, std::size_t rows, std::size_t samples, const BinScale* scales, RowSums* sums,
                   std::uint16_t* bins, std::size_t stride) {
    for (std::size_t i = 0; i < rows; ++i) sums[i] = row(values + i * samples, samples, scales[i], bins + i * stride);
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(rows_of_block);

}  // namespace

void sum_and_bin(const double* values, std::size_t rows, std::size_t samples, const BinScale* scales, RowSums* sums,
                 std::uint16_t* bins, std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(rows_of_block)(values, rows, samples, scales, sums, bins, stride);
}

void sum_and_bin_any(const double* values, std::size_t rows, std::size_t samples, std::size_t value_stride,
                     const BinScale* scales, RowSums* sums, std::uint16_t* bins, std::size_t stride) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < rows; ++i) {
        const BinScale& scale = scales[i];
        RowSums sum{0.0, 0.0, infinity, -infinity};
        for (std::size_t s = 0; s < samples; ++s) {
            const double value = values[i * value_stride + s], deviation = value - scale.mean;
            sum.first += deviation;
            sum.second += deviation * deviation;
            sum.lowest = std::min(sum.lowest, value);
            sum.highest = std::max(sum.highest, value);
            const double place = (value - scale.lower) * scale.per_width + 1.0;
            bins[i * stride + s] = std::uint16_t(std::min(std::max(place, 0.0), scale.last));
        }
        sums[i] = sum;
    }
}

}  // namespace stepdiag
#endif  // HWY_ONCE
