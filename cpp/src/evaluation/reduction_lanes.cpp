#include "evaluation/reduction_lanes.hpp"

// Not those instruction sets that differ from another one only in what is not used here.
#include <hwy/detect_targets.h>
#undef HWY_DISABLED_TARGETS
#ifdef HWY_AVX3_ZEN4  // since Highway 1.1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_AVX3_ZEN4 | HWY_AVX3_SPR)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "evaluation/reduction_lanes.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;

HWY_INLINE Vector all(double value) { return hn::Set(Tag(), value); }

struct Tilts {
    Vector alpha, beta;
};

HWY_INLINE Vector square_sum(Vector x, Vector y) { return hn::MulAdd(x, x, hn::Mul(y, y)); }

// Newton's method for g(x) x = spot, x = (-beta, alpha), as reduce_spot; multiplied by w = 1 - |x|^2 it is
//   f(x) = h x - w spot/2 = 0,  h = distance w + psd_distance + x . spot_beam,
// and needs no quotient but that by the determinant of f' = h I + x (spot_beam - 2 distance x)^T + spot x^T. Each lane
// stops by itself. NaN where no mirror gives that spot.
HWY_INLINE Tilts tilts_of_spot(const ReducedRow& row, Vector distance, Vector spot_x, Vector spot_y) {
    const Vector one = all(1.0), psd = all(row.psd_distance), u = all(row.spot_beam_x), v = all(row.spot_beam_y);
    const Vector half_x = hn::Mul(spot_x, all(0.5)), half_y = hn::Mul(spot_y, all(0.5));
    const Vector start = hn::Div(one, hn::Add(distance, psd));
    Vector x = hn::Mul(half_x, start), y = hn::Mul(half_y, start);
    Mask possible = hn::And(hn::Gt(distance, hn::Zero(Tag())), hn::Gt(start, hn::Zero(Tag())));
    Mask done = hn::Not(possible);
    for (int iteration = 0; iteration < 20 && !hn::AllTrue(Tag(), done); ++iteration) {
        const Vector w = hn::Sub(one, square_sum(x, y));
        const Vector h = hn::MulAdd(distance, w, hn::MulAdd(x, u, hn::MulAdd(y, v, psd)));
        const Vector f_x = hn::MulSub(h, x, hn::Mul(w, half_x)), f_y = hn::MulSub(h, y, hn::Mul(w, half_y));
        const Vector twice = hn::Add(distance, distance);
        const Vector h_x = hn::NegMulAdd(twice, x, u), h_y = hn::NegMulAdd(twice, y, v);
        const Vector a = hn::MulAdd(x, h_x, hn::MulAdd(spot_x, x, h)), b = hn::MulAdd(x, h_y, hn::Mul(spot_x, y));
        const Vector c = hn::MulAdd(y, h_x, hn::Mul(spot_y, x)), d = hn::MulAdd(y, h_y, hn::MulAdd(spot_y, y, h));
        const Vector determinant = hn::MulSub(a, d, hn::Mul(b, c)), inverse = hn::Div(one, determinant);
        const Vector by_x = hn::Mul(inverse, hn::MulSub(d, f_x, hn::Mul(b, f_y)));
        const Vector by_y = hn::Mul(inverse, hn::MulSub(a, f_y, hn::Mul(c, f_x)));
        x = hn::IfThenElse(done, x, hn::Sub(x, by_x));
        y = hn::IfThenElse(done, y, hn::Sub(y, by_y));
        const Mask regular = hn::And(hn::Gt(h, hn::Zero(Tag())), hn::Gt(determinant, hn::Zero(Tag())));
        possible = hn::And(possible, hn::Or(done, hn::And(regular, hn::Lt(square_sum(x, y), one))));
        // A relative change of e leaves an error of e^2 times the relative bend of g over x, below 1e-3.
        const Mask small = hn::Le(square_sum(by_x, by_y), hn::Mul(all(1e-12), square_sum(x, y)));
        done = hn::Or(done, hn::Or(small, hn::Not(possible)));
    }
    possible = hn::And(possible, done);
    const Vector none = hn::NaN(Tag());
    return {hn::IfThenElse(possible, y, none), hn::IfThenElse(possible, hn::Neg(x), none)};
}

// Tilts and distance of beams, as reduce_beams.
HWY_INLINE Tilts tilts_of_beams(Vector a, Vector b) {
    const Vector root = hn::Sqrt(hn::MulAdd(all(4.0), square_sum(a, b), all(1.0)));
    const Vector w = hn::Div(all(2.0), hn::Add(all(1.0), root));
    return {hn::Mul(w, a), hn::Mul(w, b)};
}

// One vector of lanes.
class Reducer {
public:
    Reducer(const double* readings, std::size_t stride, double* inputs)
        : readings_(readings), stride_(stride), inputs_(inputs) {}

    HWY_INLINE void reduce(const ReducedRow& row, const std::uint32_t* raws, const double* solution) {
        if (row.kind == ReducedRow::distance) return put_length(row, raw(raws[0]));
        if (row.kind == ReducedRow::tilts) return put_tilts(row, {raw(raws[0]), raw(raws[1])});
        Vector distance = raw(raws[0]);
        Tilts tilts;
        if (row.kind == ReducedRow::distance_and_tilts) {
            tilts = {raw(raws[1]), raw(raws[2])};
        } else if (row.kind == ReducedRow::spot) {
            tilts = tilts_of_spot(row, distance, raw(raws[1]), raw(raws[2]));
        } else {
            Vector sum[3] = {hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag())};
            for (std::uint32_t i = 0; i < row.raws; ++i) {
                const Vector beam = raw(raws[i]);
                for (int k = 0; k < 3; ++k) sum[k] = hn::MulAdd(beam, all(solution[3 * i + k]), sum[k]);
            }
            distance = sum[0];
            tilts = tilts_of_beams(sum[1], sum[2]);
        }
        if (row.by_distance_alone) return put_length(row, distance);
        put_tilts(row, tilts);
        // The beam's length, less the lever arm's part by the tilts.
        const Vector w = hn::Sub(all(1.0), square_sum(tilts.alpha, tilts.beta));
        const Vector lever = hn::MulSub(all(row.lateral_y), tilts.alpha, hn::Mul(all(row.lateral_x), tilts.beta));
        put_length(row, hn::MulAdd(distance, w, lever));
    }

    HWY_INLINE void report(bool* lost) const {
        const Vector nothing = hn::Mul(hn::Add(lengths_, tilts_), hn::Zero(Tag()));  // NaN, or 0
        double number[program_lanes];
        hn::StoreU(nothing, Tag(), number);
        for (std::size_t lane = 0; lane < hn::Lanes(Tag()); ++lane) lost[lane] = !(number[lane] == 0.0);
    }

private:
    HWY_INLINE Vector raw(std::uint32_t place) const { return hn::LoadU(Tag(), readings_ + place * stride_); }
    HWY_INLINE void put(std::uint32_t place, Vector value) const {
        hn::StoreU(value, Tag(), inputs_ + place * program_lanes);
    }
    HWY_INLINE void put_length(const ReducedRow& row, Vector length) {
        lengths_ = hn::Add(lengths_, length);
        put(row.place, hn::Sub(length, all(row.travel)));
    }
    // Tilts of 45 degrees and more send no beam back.
    HWY_INLINE void put_tilts(const ReducedRow& row, Tilts tilts) {
        const Vector t = square_sum(tilts.alpha, tilts.beta);
        tilts_ = hn::Add(tilts_, hn::IfThenElse(hn::Lt(t, all(1.0)), t, hn::NaN(Tag())));
        put(row.place + 1, tilts.alpha);
        put(row.place + 2, tilts.beta);
    }

    const double* readings_;
    std::size_t stride_;
    double* inputs_;
    // Sums, in which what is not finite stays.
    Vector lengths_ = hn::Zero(Tag()), tilts_ = hn::Zero(Tag());
};

LaneReduction::Lost reduce_lanes(const LaneReduction& reduction, const double* readings, std::size_t stride,
                                 double* inputs) {
    LaneReduction::Lost lost;
    for (std::size_t lane = 0; lane < program_lanes; lane += hn::Lanes(Tag())) {
        Reducer reducer(readings + lane, stride, inputs + lane);
        const std::uint32_t* raws = reduction.raws();
        const double* solution = reduction.solutions();
        for (const ReducedRow& row : reduction.rows()) {
            reducer.reduce(row, raws, solution);
            raws += row.raws;
            if (row.kind == ReducedRow::beams) solution += 3 * row.raws;
        }
        reducer.report(lost.data() + lane);
    }
    return lost;
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(reduce_lanes);

}  // namespace

LaneReduction::Lost LaneReduction::reduce(const double* readings, std::size_t stride, double* inputs) const {
    return HWY_DYNAMIC_DISPATCH(reduce_lanes)(*this, readings, stride, inputs);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
