#include "uncertainty/simd_pass.hpp"

#include "uncertainty/run_model.hpp"

// Not those instruction sets that differ from another one only in what is not used here.
#include <hwy/detect_targets.h>
#undef HWY_DISABLED_TARGETS
#ifdef HWY_AVX3_ZEN4  // since Highway 1.1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_AVX3_ZEN4 | HWY_AVX3_SPR)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "uncertainty/simd_pass.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set

// Vectors before the physics that is calculated with them:
#include "core/simd-inl.hpp"
//
#include "optics/encounter-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {
namespace {

// --- rows of lanes as vectors ---

STEPDIAG_INLINE Pair common(double value) { return broadcast(Type<Pair>(), value); }
STEPDIAG_INLINE Pair at(const SimdRow& row, std::size_t lane) { return load(row.value + lane); }
STEPDIAG_INLINE MaskPair all_true() {
    const Pair zero = common(0.0);
    return zero <= zero;
}
STEPDIAG_INLINE void keep(MaskPair followed, std::uint8_t* to) {
    std::uint8_t here[2 * hn::MaxLanes(Tag())];
    store(followed, here);
    for (std::size_t i = 0; i < 2 * hn::Lanes(Tag()); ++i) to[i] &= here[i];
}

// --- faces as `meet` takes them ---

struct CommonFace {
    const SimdFace& face;

    STEPDIAG_INLINE Pair rotation(int k) const { return common(face.plane[k]); }
    STEPDIAG_INLINE Pair translation(int k) const { return common(face.plane[9 + k]); }
    STEPDIAG_INLINE Pair index() const { return common(face.index_before); }
    STEPDIAG_INLINE Pair inverse_index() const { return common(face.inverse_index); }
    STEPDIAG_INLINE Pair index_ratio() const { return common(face.index_ratio); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return common(face.one_less_ratio2); }
};

struct FaceByLane {
    const SimdFace& face;
    std::size_t lane;

    STEPDIAG_INLINE Pair rotation(int k) const { return at(face.plane_rows[k], lane); }
    STEPDIAG_INLINE Pair translation(int k) const { return at(face.plane_rows[9 + k], lane); }
    STEPDIAG_INLINE Pair index() const { return at(*face.before_row, lane); }
    STEPDIAG_INLINE Pair inverse_index() const { return common(1.0) / index(); }
    STEPDIAG_INLINE Pair index_ratio() const { return index() / at(*face.after_row, lane); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return sub_mul(index_ratio(), index_ratio(), common(1.0)); }
};

// The mirror at one pose.
struct Mirror {
    const SimdSetup& setup;
    std::size_t lane;
    Pair normal[3];  // in the sensor frame
    Pair centre[3];
    Pair air, inverse_air;

    struct Met {
        Event event = Event::reflected;
        bool deflects = true;
        const Outline* outline;
    };
    STEPDIAG_INLINE Pair rotation(int k) const { return k < 6 ? at(setup.mirror_axes[k], lane) : normal[k - 6]; }
    STEPDIAG_INLINE Pair translation(int k) const {
        return negative(mul_add(rotation(3 * k), centre[0],
                                mul_add(rotation(3 * k + 1), centre[1], rotation(3 * k + 2) * centre[2])));
    }
    STEPDIAG_INLINE Pair index() const { return air; }
    STEPDIAG_INLINE Pair inverse_index() const { return inverse_air; }
    STEPDIAG_INLINE Pair index_ratio() const { return common(1.0); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return common(0.0); }
};

STEPDIAG_INLINE void through(const std::vector<SimdFace>& faces, std::size_t lane, Pair gap, Light<Pair>& light) {
    for (const SimdFace& face : faces) {
        if (face.plane_rows) meet(face, FaceByLane{face, lane}, gap, light);
        else meet(face, CommonFace{face}, gap, light);
    }
}

// v <- Exp(w) v, by the series of rotation_exp; lanes above 1e-3 rad, where it ends, are not followed.
STEPDIAG_INLINE void turn(const Pair (&w)[3], Pair (&v)[3], MaskPair& followed) {
    const Pair angle2 = mul_add(w[0], w[0], mul_add(w[1], w[1], w[2] * w[2]));
    followed = both(followed, angle2 <= common(1e-6));
    const Pair sinc = mul_add(angle2, mul_add(angle2, common(1.0 / 120), common(-1.0 / 6)), common(1.0));
    const Pair versine = mul_add(angle2, mul_add(angle2, common(1.0 / 720), common(-1.0 / 24)), common(0.5));
    const auto cross = [&](const Pair(&a)[3], int k) HWY_ATTR {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        return sub_mul(w[j], a[i], w[i] * a[j]);
    };
    const Pair once[3] = {cross(v, 0), cross(v, 1), cross(v, 2)};
    const Pair twice[3] = {cross(once, 0), cross(once, 1), cross(once, 2)};
    for (int k = 0; k < 3; ++k) v[k] = mul_add(versine, twice[k], mul_add(sinc, once[k], v[k]));
}

// The mirror of a pose in the sensor frame: normal R S^-1 n, centre S^-1 (p - o).
STEPDIAG_INLINE void place_mirror(const SimdPass& pass, std::size_t row, std::size_t lane, Mirror& mirror,
                                  MaskPair& followed) {
    const SimdSetup& setup = *pass.setup;
    const ToolPose& pose = pass.poses[row];
    Pair normal[3], point[3];
    const Pair n[3] = {at(setup.mirror_normal[0], lane), at(setup.mirror_normal[1], lane),
                       at(setup.mirror_normal[2], lane)};
    for (int k = 0; k < 3; ++k) {
        const double* const r = pose.rotation + 3 * k;
        normal[k] = mul_add(common(r[0]), n[0], mul_add(common(r[1]), n[1], common(r[2]) * n[2]));
        point[k] = common(pose.position[k]);
    }
    if (pass.displaced) {
        const SimdRow* const by = pass.displaced + 6 * row;
        for (int k = 0; k < 3; ++k) point[k] = point[k] + at(by[k], lane);
        const Pair w[3] = {at(by[3], lane), at(by[4], lane), at(by[5], lane)};
        turn(w, normal, followed);
    }
    for (int k = 0; k < 3; ++k) {
        const Pair r[3] = {at(setup.sensor_R_machine[3 * k], lane), at(setup.sensor_R_machine[3 * k + 1], lane),
                           at(setup.sensor_R_machine[3 * k + 2], lane)};
        mirror.normal[k] = mul_add(r[0], normal[0], mul_add(r[1], normal[1], r[2] * normal[2]));
        mirror.centre[k] = dot_add(r, point, at(setup.translation[k], lane));
    }
}

// L tan^2 phi
STEPDIAG_INLINE Pair excess_of(const Mirror& mirror) {
    const Pair inverse = common(1.0) / mirror.normal[2];
    const Pair length = negative(mirror.translation(2)) * inverse;
    const Pair tilt2 = mul_add(mirror.normal[0], mirror.normal[0], mirror.normal[1] * mirror.normal[1]);
    return length * tilt2 * inverse * inverse;
}

// --- what a detector says ---

STEPDIAG_INLINE void detect(const SimdBeam& beam, std::size_t lane, Light<Pair>& light, double* to) {
    if (beam.detector == SimdDetector::spot) {
        for (int axis = 0; axis < 2; ++axis) {
            const SimdRow* const map = beam.detector_rows + 4 * axis;
            const Pair row[3] = {at(map[0], lane), at(map[1], lane), at(map[2], lane)};
            store(dot_add(row, light.point, at(map[3], lane)), to + std::size_t(axis) * lane_group + lane);
        }
        return;
    }
    const Pair distance = mul_add(common(beam.scale), light.optical_length, at(*beam.offset, lane));
    store(distance, to + lane);
    light.followed = both(light.followed, is_finite(distance));
    const SimdRow* const axis = beam.detector_rows;
    const Pair along = mul_add(at(axis[0], lane), light.direction[0],
                               mul_add(at(axis[1], lane), light.direction[1], at(axis[2], lane) * light.direction[2]));
    light.followed = both(light.followed, along <= common(-beam.least_cosine));
}

// --- set-ups ---

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

// --- kernels ---

void trace(const SimdPass& pass, const Outline& outline, const std::vector<SimdBeam>& beams, double nearest) {
    const Pair gap = common(nearest);
    const Mirror::Met met{Event::reflected, true, &outline};
    Light<Pair> out[most_simd_beams];
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        MaskPair followed = all_true();
        for (std::size_t b = 0; b < beams.size(); ++b) {
            const SimdRow* const s = beams[b].source;
            out[b] = {{at(s[0], lane), at(s[1], lane), at(s[2], lane)},
                      {at(s[3], lane), at(s[4], lane), at(s[5], lane)},
                      common(0.0),
                      common(0.0),
                      all_true()};
            through(beams[b].out, lane, gap, out[b]);
            followed = both(followed, out[b].followed);
        }
        for (std::size_t row = 0; row < pass.rows; ++row) {
            Mirror mirror{*pass.setup, lane, {}, {}, {}, {}};
            place_mirror(pass, row, lane, mirror, followed);
            if (pass.excess) store(excess_of(mirror), pass.excess[row].value + lane);
            for (std::size_t b = 0; b < beams.size(); ++b) {
                const SimdBeam& beam = beams[b];
                Light<Pair> light = out[b];
                mirror.air = at(*beam.air, lane);
                mirror.inverse_air = common(1.0);  // nobody asks for the reduced length
                meet(met, mirror, gap, light);
                through(beam.back, lane, gap, light);
                detect(beam, lane, light,
                       pass.readings + (row * pass.channels + std::size_t(beam.channel)) * lane_group);
                followed = both(followed, light.followed);
            }
        }
        keep(followed, pass.followed + lane);
    }
}

// Follows where every beam is read by the rules of define_signals and a little to spare.
void define(const SimdPass& pass, const SimdClosed& closed) {
    const Pair zero = common(0.0), one = common(1.0), aside = common(0.25 * closed.aperture);
    const Pair half_mirror[2] = {common(closed.half_mirror[0]), common(closed.half_mirror[1])};
    const SimdRow* const axes = pass.setup->mirror_axes;
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const Pair ratio = at(*closed.index_ratio, lane);
        MaskPair followed = is_finite(ratio);  // else the air is out of its equation's range
        for (std::size_t row = 0; row < pass.rows; ++row) {
            Mirror mirror{*pass.setup, lane, {}, {}, {}, {}};
            place_mirror(pass, row, lane, mirror, followed);
            if (pass.excess) store(excess_of(mirror), pass.excess[row].value + lane);
            const Pair inverse = one / mirror.normal[2];
            const Pair alpha = negative(mirror.normal[1] * inverse), beta = mirror.normal[0] * inverse;
            const Pair length = mul_add(beta, mirror.centre[0], sub_mul(alpha, mirror.centre[1], mirror.centre[2]));
            const Pair w = sub_mul(alpha, alpha, sub_mul(beta, beta, one));  // 1 - t
            const Pair by_w = one / w;
            const Pair distance = length * by_w;
            followed = both(followed, both(both(mirror.normal[2] > zero, w > zero), length > zero));
            // The beam from (u, v) meets the mirror's plane at (u, v, alpha v - beta u) and a constant.
            Pair along[2][2];
            for (int axis = 0; axis < 2; ++axis) {
                const Pair z = at(axes[3 * axis + 2], lane);
                along[axis][0] = sub_mul(z, beta, at(axes[3 * axis], lane));
                along[axis][1] = mul_add(z, alpha, at(axes[3 * axis + 1], lane));
            }
            const Pair tilt = magnitude(alpha) + magnitude(beta);  // at least the larger one
            const auto check = [&](Pair u, Pair v, Pair beam_distance) HWY_ATTR {
                const Pair x = u - mirror.centre[0], y = v - mirror.centre[1];
                for (int axis = 0; axis < 2; ++axis) {
                    const Pair met = mul_add(along[axis][0], x, along[axis][1] * y);
                    followed = both(followed, magnitude(met) <= half_mirror[axis]);
                }
                followed = both(followed, both(beam_distance > zero, beam_distance * tilt <= aside));
            };
            double* const to = pass.readings + row * pass.channels * lane_group + lane;
            if (closed.layout == HeadLayout::multi_beam) {
                for (std::size_t i = 0; i < pass.channels; ++i) {
                    const Pair u = at(closed.beams[2 * i], lane), v = at(closed.beams[2 * i + 1], lane);
                    const Pair beam_distance = mul_add(sub_mul(beta, u, alpha * v), by_w, distance);
                    check(u, v, beam_distance);
                    store(beam_distance * ratio, to + i * lane_group);
                }
                continue;
            }
            check(zero, zero, distance);
            store(distance * ratio, to);
            if (closed.layout == HeadLayout::psd) {
                const Pair reach = mul_add(at(*closed.psd_distance, lane), by_w, distance);
                const Pair gain = reach + reach;
                store(negative(gain * beta), to + lane_group);
                store(gain * alpha, to + 2 * lane_group);
            } else {
                store(alpha, to + lane_group);
                store(beta, to + 2 * lane_group);
            }
        }
        keep(followed, pass.followed + lane);
    }
}

void place_head_and_mirror(const LineFrame& line, const SimdRow* fields, SimdSetup& setup,
                           std::uint8_t* followed_lanes) {
    const auto frame = [&](int k) HWY_ATTR { return common(line.frame[k]); };
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const auto number = [&](int k) HWY_ATTR { return at(fields[k], lane); };
        const Pair zero = common(0.0);
        MaskPair followed = all_true();
        Pair turned[9], rolled[9], tilted[9], sensor[9], mirror[9];
        exponential(number(field::laser), number(field::laser + 1), zero, turned, followed);
        product(frame, turned, tilted);
        exponential(zero, zero, number(field::roll), rolled, followed);
        product([&](int k) HWY_ATTR { return tilted[k]; }, rolled, sensor);
        exponential(number(field::reflector), number(field::reflector + 1), zero, turned, followed);
        product(frame, turned, mirror);
        Pair origin[3];
        for (int k = 0; k < 3; ++k)
            origin[k] = mul_add(frame(3 * k), number(field::lateral),
                                mul_add(frame(3 * k + 1), number(field::lateral + 1), common(line.origin[k])));
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

void correct(const SimdPass& pass, const SimdCorrection& c) {
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const Pair drift = at(*c.drift, lane), model = at(*c.model, lane), w = at(*c.wavelength, lane);
        const Pair factor = at(*c.factor, lane), length = at(*c.length, lane), gain = at(*c.gain, lane);
        for (std::size_t row = 0; row < pass.rows; ++row) {
            Pair added = drift * common(c.elapsed[row]);
            if (pass.excess) added = mul_add(model, at(pass.excess[row], lane), added);
            const Pair scaled = mul_add(factor, common(c.travel[row]), length * common(c.is_last[row]));
            for (std::size_t i = 0; i < pass.channels; ++i) {
                double* const reading = pass.readings + (row * pass.channels + i) * lane_group + lane;
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
        for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
            double* const to = readings + row * stride + lane;
            store(mul_add(factor, load(normals + row * lane_group + lane), constant) + load(to), to);
        }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(trace);
HWY_EXPORT(define);
HWY_EXPORT(place_head_and_mirror);
HWY_EXPORT(correct);
HWY_EXPORT(add_noise_rows);

}  // namespace

void trace_pass(const SimdPass& pass, const Outline& mirror, const std::vector<SimdBeam>& beams, double gap) {
    HWY_DYNAMIC_DISPATCH(trace)(pass, mirror, beams, gap);
}
void define_pass(const SimdPass& pass, const SimdClosed& closed) { HWY_DYNAMIC_DISPATCH(define)(pass, closed); }

void set_up_pass(const LineFrame& line, const SimdRow* fields, SimdSetup& setup, std::uint8_t* followed) {
    HWY_DYNAMIC_DISPATCH(place_head_and_mirror)(line, fields, setup, followed);
}
void correct_pass(const SimdPass& pass, const SimdCorrection& correction) {
    HWY_DYNAMIC_DISPATCH(correct)(pass, correction);
}
void add_noise_to_pass(const double* normals, std::size_t rows, double spread, double expectation, double* readings,
                       std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(add_noise_rows)(normals, rows, spread, expectation, readings, stride);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
