#include "uncertainty/simd_pass.hpp"
#include "uncertainty/run_slots.hpp"

// Not those instruction sets that differ from another one only in what is not used here.
#include <hwy/detect_targets.h>
#undef HWY_DISABLED_TARGETS
#ifdef HWY_AVX3_ZEN4  // since Highway 1.1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_AVX3_ZEN4 | HWY_AVX3_SPR)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "uncertainty/lane_setup.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set

#include "uncertainty/lane_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {
namespace {

// Rows of Exp(x, y, z), sinc and versine by their series.
STEPDIAG_INLINE void exponential(Pair x, Pair y, Pair z, Pair (&r)[9], MaskPair& followed) {
    const Pair one = common(1.0), t = mul_add(x, x, mul_add(y, y, z * z));
    followed = both(followed, t <= common(0.01));
    // Next terms: t^6 / 6e9, below 1e-21.
    Pair sinc = common(-1.0 / 39916800), v = common(-1.0 / 479001600);
    for (const double c : {1.0 / 362880, -1.0 / 5040, 1.0 / 120, -1.0 / 6, 1.0}) sinc = mul_add(sinc, t, common(c));
    for (const double c : {1.0 / 3628800, -1.0 / 40320, 1.0 / 720, -1.0 / 24, 0.5}) v = mul_add(v, t, common(c));
    const Pair sx = sinc * x, sy = sinc * y, sz = sinc * z, vx = v * x, vy = v * y, vz = v * z;
    r[0] = sub_mul(vy, y, sub_mul(vz, z, one)), r[1] = mul_add(vx, y, negative(sz)), r[2] = mul_add(vx, z, sy);
    r[3] = mul_add(vx, y, sz), r[4] = sub_mul(vx, x, sub_mul(vz, z, one)), r[5] = mul_add(vy, z, negative(sx));
    r[6] = mul_add(vx, z, negative(sy)), r[7] = mul_add(vy, z, sx), r[8] = sub_mul(vx, x, sub_mul(vy, y, one));
}

// c = a b
template <class A>
STEPDIAG_INLINE void product(const A& a, const Pair (&b)[9], Pair (&c)[9]) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            c[3 * i + j] = mul_add(a(3 * i), b[j], mul_add(a(3 * i + 1), b[3 + j], a(3 * i + 2) * b[6 + j]));
}

}  // namespace

void set_up_visit(const LineFrame& line, const LaneRow* slots, LaneSetup& setup, std::uint8_t* followed_lanes) {
    const auto frame = [&](int k) HWY_ATTR { return common(line.frame[k]); };
    for (std::size_t lane = 0; lane < run_lanes; lane += 2 * hn::Lanes(Tag())) {
        const auto number = [&](int k) HWY_ATTR { return at(slots[k], lane); };
        const Pair zero = common(0.0);
        MaskPair followed = all_true();
        Pair turned[9], rolled[9], tilted[9], sensor[9], mirror[9];
        exponential(number(slot::laser), number(slot::laser + 1), zero, turned, followed);
        product(frame, turned, tilted);
        exponential(zero, zero, number(slot::roll), rolled, followed);
        product([&](int k) HWY_ATTR { return tilted[k]; }, rolled, sensor);
        exponential(number(slot::reflector), number(slot::reflector + 1), zero, turned, followed);
        product(frame, turned, mirror);
        Pair origin[3];
        for (int k = 0; k < 3; ++k)
            origin[k] = mul_add(frame(3 * k), number(slot::lateral),
                                mul_add(frame(3 * k + 1), number(slot::lateral + 1), common(line.origin[k])));
        for (int i = 0; i < 3; ++i) {  // rows of sensor_R_machine are columns of machine_R_sensor
            for (int j = 0; j < 3; ++j) store(sensor[3 * j + i], setup.sensor_R_machine[3 * i + j].value + lane);
            const auto in_sensor = [&](Pair x, Pair y, Pair z) HWY_ATTR {
                return mul_add(sensor[i], x, mul_add(sensor[3 + i], y, sensor[6 + i] * z));
            };
            store(negative(in_sensor(origin[0], origin[1], origin[2])), setup.translation[i].value + lane);
            store(mirror[3 * i + 2], setup.mirror_normal[i].value + lane);
            for (int axis = 0; axis < 2; ++axis)
                store(in_sensor(mirror[axis], mirror[3 + axis], mirror[6 + axis]),
                      setup.mirror_axes[3 * axis + i].value + lane);
        }
        keep(followed, followed_lanes + lane);
    }
}

void correct_visit(const LaneVisit& visit, const LaneCorrection& c) {
    for (std::size_t lane = 0; lane < run_lanes; lane += 2 * hn::Lanes(Tag())) {
        const Pair drift = at(*c.drift, lane), model = at(*c.model, lane), w = at(*c.wavelength, lane);
        const Pair factor = at(*c.factor, lane), length = at(*c.length, lane), gain = at(*c.gain, lane);
        for (std::size_t row = 0; row < visit.rows; ++row) {
            Pair added = drift * common(c.elapsed[row]);
            if (visit.excess) added = mul_add(model, at(visit.excess[row], lane), added);
            const Pair scaled = mul_add(factor, common(c.travel[row]), length * common(c.is_last[row]));
            for (std::size_t i = 0; i < visit.channels; ++i) {
                double* const reading = visit.readings + (row * visit.channels + i) * run_lanes + lane;
                const Pair value = load(reading), constant = at(c.constant[i], lane);
                if (c.is_distance[i]) store(mul_add(value + (constant + added), w, scaled), reading);
                else store(mul_add(value, gain, constant), reading);
            }
        }
    }
}

void add_noise_rows(const double* normals, std::size_t rows, double spread, double expectation, double* readings,
                    std::size_t stride) {
    const Pair factor = common(spread), constant = common(expectation);
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t lane = 0; lane < run_lanes; lane += 2 * hn::Lanes(Tag())) {
            double* const to = readings + row * stride + lane;
            store(mul_add(factor, load(normals + row * run_lanes + lane), constant) + load(to), to);
        }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(set_up_visit);
HWY_EXPORT(correct_visit);
HWY_EXPORT(add_noise_rows);

}  // namespace

void set_up_lanes(const LineFrame& line, const LaneRow* slots, LaneSetup& setup, std::uint8_t* followed) {
    HWY_DYNAMIC_DISPATCH(set_up_visit)(line, slots, setup, followed);
}
void correct_lanes(const LaneVisit& visit, const LaneCorrection& correction) {
    HWY_DYNAMIC_DISPATCH(correct_visit)(visit, correction);
}
void add_noise_lanes(const double* normals, std::size_t rows, double spread, double expectation, double* readings,
                     std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(add_noise_rows)(normals, rows, spread, expectation, readings, stride);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
