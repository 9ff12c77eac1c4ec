#include "batch/simd_reduction.hpp"

#include "batch/batch_method.hpp"
#include "core/simd_targets.hpp"
#include "evaluation/linear_evaluation.hpp"
#include "evaluation/measurement_rows.hpp"
#define HWY_TARGET_INCLUDE "batch/simd_reduction.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {
namespace {

STEPDIAG_INLINE Pair square_sum(Pair x, Pair y) { return mul_add(x, x, y * y); }

struct Tilts {
    Pair alpha, beta;
};

// (-beta, alpha) is k spot, because a spot lies in the direction of the light. Then the equation g(x) x = spot of
// reduce_spot becomes
//   h k = w,  h = 2 (distance w + psd_distance + k spot . spot_beam),  w = 1 - k^2
// spot
// ^2,
// and with k = c/D, D = 2 (distance + psd_distance):
//   f(c) = c + p c^2 - q c^3 - 1 = 0,  p = 2 spot . spot_beam/D^2 + r,  q = 2 distance r/D,  r =
// spot
// ^2/D^2,
// where p and q are small: r is about the square of the tilt.
struct SpotEquation {
    Pair p, q, r;

    STEPDIAG_INLINE Pair f(Pair c) const { return mul_add(mul_add(sub_mul(q, c, p), c, all(1.0)), c, all(-1.0)); }
};

// Newton's method. Each lane stops by itself (`done`). A spot that no mirror gives ends as NaN.
HWY_NOINLINE Pair solve_by_newton(const SpotEquation& spot, MaskPair done, Pair c) {
    const Pair zero = all(0.0), one = all(1.0);
    MaskPair possible = all_true();
    for (int iteration = 0; iteration < 20 && !is_everywhere(done); ++iteration) {
        const Pair slope = mul_add(sub_mul(all(3.0) * spot.q, c, spot.p + spot.p), c, one);
        const Pair change = spot.f(c) / slope;
        c = select(done, c, c - change);
        const Pair h_by_d = mul_add(sub_mul(spot.q, c, spot.p - spot.r), c, one), w = sub_mul(spot.r * c, c, one);
        possible = both(possible, either(done, both(both(h_by_d > zero, slope > zero), w > zero)));
        // Convergence is quadratic: after a change of 1e-8 the error is below 1e-16.
        done = either(done, either(magnitude(change) <= all(1e-8) * magnitude(c), no(possible)));
    }
    return select(both(possible, done), c, none());
}

STEPDIAG_INLINE Tilts tilts_of_spot(const ReducedRow& row, Pair distance, Pair spot_x, Pair spot_y) {
    const Pair one = all(1.0), twice = distance + distance, inverse = one / (twice + all(2.0 * row.psd_distance));
    const Pair inverse2 = inverse * inverse, r = square_sum(spot_x, spot_y) * inverse2;
    SpotEquation spot{r, twice * inverse * r, r};
    if (row.is_beside) {
        const Pair beam = mul_add(spot_x, all(2.0 * row.spot_beam_x), spot_y * all(2.0 * row.spot_beam_y));
        spot.p = mul_add(beam, inverse2, r);
    }
    // The root to second order, 1 - (p - q)(1 - 2 p + 3 q), then a step of Newton's method with 1/f' to first order,
    // which is the same factor. The error that remains is about 30 p^5.
    const Pair slope = mul_add(all(3.0), spot.q, mul_add(all(-2.0), spot.p, one));
    const Pair start = sub_mul(spot.p - spot.q, slope, one);
    Pair c = sub_mul(spot.f(start), slope, start);
    const MaskPair away = both(distance > all(0.0), inverse > all(0.0));
    const MaskPair done = magnitude(spot.p) + spot.q <= all(3e-4);
    if (!is_everywhere(both(away, done))) c = solve_by_newton(spot, both(away, done), select(away, c, none()));
    const Pair k = c * inverse;
    return {k * spot_y, negative(k * spot_x)};
}

// As reduce_beams: w = 2/(1 + sqrt(1 + 4 m)). For small tilts its series; the first omitted term is 42 m^5.
STEPDIAG_INLINE Tilts tilts_of_beams(Pair a, Pair b) {
    const Pair m = square_sum(a, b), one = all(1.0);
    Pair w = mul_add(m, mul_add(m, mul_add(m, mul_add(m, all(14.0), all(-5.0)), all(2.0)), all(-1.0)), one);
    const MaskPair small = m <= all(1e-5);
    if (!is_everywhere(small)) w = select(small, w, all(2.0) / (one + root(mul_add(all(4.0), m, one))));
    return {w * a, w * b};
}

// Reduces one pair of vectors of lanes.
class Reducer {
public:
    Reducer(const double* readings, std::size_t stride, double* inputs)
        : readings_(readings), stride_(stride), inputs_(inputs) {}

    STEPDIAG_INLINE void reduce(const ReducedRow& row, const std::uint32_t* raws, const double* solution) {
        if (row.kind == ReducedRow::distance) return put_length(row, raw(raws[0]));
        if (row.kind == ReducedRow::tilts) return put_tilts(row, raw(raws[0]), raw(raws[1]));
        if (row.kind == ReducedRow::beams) return put_beams(row, raws, solution);
        const Pair distance = raw(raws[0]), first = raw(raws[1]), second = raw(raws[2]);
        put_tilts_and_length(
            row, row.kind == ReducedRow::spot ? tilts_of_spot(row, distance, first, second) : Tilts{first, second},
            distance);
    }

    STEPDIAG_INLINE void report(bool* lost) const {
        double number[lane_group];
        store((lengths_ + tilts_) * all(0.0), number);  // NaN if anything is not finite, otherwise 0
        for (std::size_t lane = 0; lane < 2 * hn::Lanes(Tag()); ++lane) lost[lane] = !(number[lane] == 0.0);
    }

private:
    STEPDIAG_INLINE Pair raw(std::uint32_t place) const { return load(readings_ + place * stride_); }
    STEPDIAG_INLINE void put_beams(const ReducedRow& row, const std::uint32_t* raws, const double* solution) {
        Pair sum[3] = {all(0.0), all(0.0), all(0.0)};
        for (std::uint32_t i = 0; i < row.raws; ++i) {
            const Pair beam = raw(raws[i]);
            for (int k = 0; k < 3; ++k) sum[k] = mul_add(beam, all(solution[3 * i + k]), sum[k]);
        }
        if (row.by_distance_alone) put_length(row, sum[0]);
        else put_tilts_and_length(row, tilts_of_beams(sum[1], sum[2]), sum[0]);
    }
    // The length of the beam, less the tilts' effect by the lever arm.
    STEPDIAG_INLINE void put_tilts_and_length(const ReducedRow& row, Tilts tilts, Pair distance) {
        const Pair t = square_sum(tilts.alpha, tilts.beta);
        const Pair lever = sub_mul(all(row.lateral_x), tilts.beta, all(row.lateral_y) * tilts.alpha);
        put_tilts(row, tilts, t);
        put_length(row, mul_add(distance, all(1.0) - t, lever));
    }
    STEPDIAG_INLINE void put_length(const ReducedRow& row, Pair length) {
        lengths_ = lengths_ + length;
        store(length - all(row.travel), inputs_ + row.place * lane_group);
    }
    STEPDIAG_INLINE void put_tilts(const ReducedRow& row, Pair alpha, Pair beta) {
        put_tilts(row, {alpha, beta}, square_sum(alpha, beta));
    }
    // A mirror tilted by 45 degrees or more returns no beam.
    STEPDIAG_INLINE void put_tilts(const ReducedRow& row, Tilts tilts, Pair t) {
        tilts_ = tilts_ + select(all(1.0) > t, t, none());
        store(tilts.alpha, inputs_ + (row.place + 1) * lane_group);
        store(tilts.beta, inputs_ + (row.place + 2) * lane_group);
    }

    const double* readings_;
    std::size_t stride_;
    double* inputs_;
    // Sums of all results, which reveal values that are not finite.
    Pair lengths_ = all(0.0), tilts_ = all(0.0);
};

}  // namespace

SimdReduction::Lost reduce_lanes(const SimdReduction& reduction, const double* readings, std::size_t stride,
                                 double* inputs) {
    SimdReduction::Lost lost;
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
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

SimdReduction::Lost SimdReduction::reduce(const double* readings, std::size_t stride, double* inputs) const {
    return HWY_DYNAMIC_DISPATCH(reduce_lanes)(*this, readings, stride, inputs);
}

// --- rows of the pattern ---

namespace {

// Finds the raw channels that were read in a row.
class RawPlaces {
public:
    explicit RawPlaces(const Measurement& pattern) : pattern_(pattern), signals_(signal_channels(pattern)) {}

    std::size_t channels() const { return signals_.size(); }
    std::optional<std::uint32_t> of(const std::string& channel, std::size_t row) const {
        for (std::size_t c = 0; c < signals_.size(); ++c) {
            const Channel& signal = pattern_.channels()[signals_[c]];
            if (signal.name == channel && signal.value[row]) return std::uint32_t(row * signals_.size() + c);
        }
        return std::nullopt;
    }

private:
    const Measurement& pattern_;
    std::vector<int> signals_;
};

// Raw channels of one row, as passes.cpp uses them; `raws` is empty if the reading was lost.
struct TakenRow {
    ReducedRow::Kind kind = ReducedRow::distance;
    std::vector<std::uint32_t> raws = {};
    std::vector<double> solution = {};
};

TakenRow take_beams(const RawPlaces& places, int beams, std::size_t row, const HeadCalibration& head) {
    TakenRow taken{ReducedRow::beams};
    std::vector<Eigen::Vector2d> offsets;
    for (int i = 0; i < beams; ++i)
        if (const auto raw = places.of("d" + std::to_string(i + 1), row)) {
            taken.raws.push_back(*raw);
            offsets.push_back(head.beam_offsets[i]);
        }
    // With equal lengths of all beams, the derivatives of the solution are its coefficients.
    const auto reduced = reduce_beams(Eigen::VectorXd::Zero(Eigen::Index(offsets.size())), offsets);
    if (!reduced) return {};
    taken.solution.assign(reduced->jacobian.data(), reduced->jacobian.data() + reduced->jacobian.size());
    return taken;
}

TakenRow take_row(const Measurement& pattern, const RawPlaces& places, std::size_t row, const HeadCalibration& head,
                  LengthKind kind) {
    if (const int beams = pattern.beam_count()) return take_beams(places, beams, row, head);
    const auto distance = places.of("distance", row);
    if (kind == LengthKind::distance) return distance ? TakenRow{ReducedRow::distance, {*distance}} : TakenRow{};
    const bool has_spots = pattern.find("spot_x");
    const auto first = places.of(has_spots ? "spot_x" : "alpha", row);
    const auto second = places.of(has_spots ? "spot_y" : "beta", row);
    if (distance && first && second)
        return {has_spots ? ReducedRow::spot : ReducedRow::distance_and_tilts, {*distance, *first, *second}};
    if (distance) return {ReducedRow::distance, {*distance}};
    if (first && second && !has_spots) return {ReducedRow::tilts, {*first, *second}};
    return {};
}

}  // namespace

SimdReduction::SimdReduction(const Measurement& pattern, const HeadCalibrations& heads, const std::vector<Pass>& passes,
                             LengthKind kind) {
    const RawPlaces places(pattern);
    const auto rows = rows_by_pass(pattern);
    auto members = rows.begin();
    for (const Pass& pass : passes) {
        for (const std::size_t row : (members++)->second) {
            const std::optional<int>& number = pass.place[pattern.stations()[row].point];
            if (!number) continue;
            const PassPoint& point = pass.points[*number];
            const HeadCalibration& head = heads.of(pass.line.name());
            const TakenRow taken = take_row(pattern, places, row, head, kind);
            if (taken.raws.empty() || (taken.kind == ReducedRow::distance && !point.has_length)) continue;
            ReducedRow reduced{};
            reduced.kind = taken.kind;
            reduced.raws = std::uint32_t(taken.raws.size());
            reduced.place = std::uint32_t(values_per_reading * (pass.first_reading + *number));
            reduced.by_distance_alone = kind == LengthKind::distance;
            reduced.lateral_x = point.lateral.x(), reduced.lateral_y = point.lateral.y();
            reduced.travel = point.travel;
            reduced.psd_distance = head.psd_distance.value_or(0.0);
            reduced.spot_beam_x = head.spot_beam.x(), reduced.spot_beam_y = head.spot_beam.y();
            reduced.is_beside = !head.spot_beam.isZero(0.0);
            rows_.push_back(reduced);
            raws_.insert(raws_.end(), taken.raws.begin(), taken.raws.end());
            solutions_.insert(solutions_.end(), taken.solution.begin(), taken.solution.end());
        }
    }
}

}  // namespace stepdiag
#endif  // HWY_ONCE
