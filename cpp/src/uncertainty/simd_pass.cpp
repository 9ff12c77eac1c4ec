#include "uncertainty/simd_pass.hpp"

#include "core/simd_targets.hpp"
#include "uncertainty/run_model.hpp"
#define HWY_TARGET_INCLUDE "uncertainty/simd_pass.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set

// Vectors before the physics that is calculated with them:
#include "core/simd-inl.hpp"
//
#include "measurement/reading-inl.hpp"
#include "optics/encounter-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {
namespace {

// --- rows of lanes as vectors ---

STEPDIAG_INLINE Pair at(const SimdRow& row, std::size_t lane) { return load(row.value + lane); }
STEPDIAG_INLINE Vector3<Pair> at3(const SimdRow* rows, std::size_t lane) {
    return {at(rows[0], lane), at(rows[1], lane), at(rows[2], lane)};
}
STEPDIAG_INLINE Matrix3<Pair> at9(const SimdRow* rows, std::size_t lane) {
    return {at3(rows, lane), at3(rows + 3, lane), at3(rows + 6, lane)};
}
STEPDIAG_INLINE void keep(MaskPair followed, std::uint8_t* to) {
    std::uint8_t here[2 * hn::MaxLanes(Tag())];
    store(followed, here);
    for (std::size_t i = 0; i < 2 * hn::Lanes(Tag()); ++i) to[i] &= here[i];
}

// --- faces as `meet` takes them ---

struct CommonFace {
    const SimdFace& face;

    STEPDIAG_INLINE Pair rotation(int k) const { return all(face.plane[k]); }
    STEPDIAG_INLINE Pair translation(int k) const { return all(face.plane[9 + k]); }
    STEPDIAG_INLINE Pair index() const { return all(face.index_before); }
    STEPDIAG_INLINE Pair inverse_index() const { return all(face.inverse_index); }
    STEPDIAG_INLINE Pair index_ratio() const { return all(face.index_ratio); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return all(face.one_less_ratio2); }
};

struct FaceByLane {
    const SimdFace& face;
    std::size_t lane;

    STEPDIAG_INLINE Pair rotation(int k) const { return at(face.plane_rows[k], lane); }
    STEPDIAG_INLINE Pair translation(int k) const { return at(face.plane_rows[9 + k], lane); }
    STEPDIAG_INLINE Pair index() const { return at(*face.before_row, lane); }
    STEPDIAG_INLINE Pair inverse_index() const { return all(1.0) / index(); }
    STEPDIAG_INLINE Pair index_ratio() const { return index() / at(*face.after_row, lane); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return sub_mul(index_ratio(), index_ratio(), all(1.0)); }
};

// The mirror at one pose.
struct Mirror {
    const SimdSetup& setup;
    std::size_t lane;
    Vector3<Pair> normal, centre;  // in the sensor frame
    Pair air, inverse_air;

    struct Met {
        Event event = Event::reflected;
        bool deflects = true;
        const Outline* outline;
    };
    STEPDIAG_INLINE Vector3<Pair> axis(int k) const { return k < 2 ? at3(setup.mirror_axes + 3 * k, lane) : normal; }
    STEPDIAG_INLINE Pair rotation(int k) const {
        const Vector3<Pair> row = axis(k / 3);
        return k % 3 == 0 ? row.x : k % 3 == 1 ? row.y : row.z;
    }
    STEPDIAG_INLINE Pair translation(int k) const { return negative(dot(axis(k), centre)); }
    STEPDIAG_INLINE Pair index() const { return air; }
    STEPDIAG_INLINE Pair inverse_index() const { return inverse_air; }
    STEPDIAG_INLINE Pair index_ratio() const { return all(1.0); }
    STEPDIAG_INLINE Pair one_less_ratio2() const { return all(0.0); }
};

STEPDIAG_INLINE void through(const std::vector<SimdFace>& faces, std::size_t lane, Pair gap, Light<Pair>& light) {
    for (const SimdFace& face : faces) {
        if (face.plane_rows) meet(face, FaceByLane{face, lane}, gap, light);
        else meet(face, CommonFace{face}, gap, light);
    }
}

// Plates in air, for light that comes down from the mirror.
STEPDIAG_INLINE void through(const Plates& plates, Pair air, Pair gap, Light<Pair>& light) {
    Pair(&p)[3] = light.point;
    const Pair down = negative(light.direction[2]);
    const auto check = [&] HWY_ATTR {
        for (int k = 0; k < 2; ++k)
            light.followed = both(light.followed, magnitude(p[k] - all(plates.centre[k])) <= all(plates.half_size[k]));
    };
    check();
    light.followed = both(light.followed, both(down > all(0.0), p[2] - all(plates.first) > gap));
    Pair air_thickness = p[2] - all(plates.last), sideways = all(0.0);
    for (const Plates::Glass& glass : plates.glasses) {
        // With mu = n_air/n and `down` the cosine in air, that in the glass is sqrt(1 - mu^2 + mu^2 down^2).
        const Pair mu = air * all(1.0 / glass.index), cosine = mu * down;
        const Pair length = all(glass.thickness) / root(mul_add(cosine, cosine, sub_mul(mu, mu, all(1.0))));
        sideways = mul_add(length, mu, sideways);
        light.optical_length = mul_add(length, all(glass.index), light.optical_length);
        air_thickness = air_thickness - all(glass.thickness);
    }
    const Pair in_air = air_thickness / down;
    sideways = sideways + in_air;
    for (int k = 0; k < 2; ++k) p[k] = mul_add(sideways, light.direction[k], p[k]);
    p[2] = all(plates.last);
    light.optical_length = mul_add(in_air, air, light.optical_length);
    check();
}

// Lanes that are turned farther than the series of a rotation reach are not followed.
STEPDIAG_INLINE void keep_small(const Vector3<Pair>& turn, MaskPair& followed) {
    followed = both(followed, dot(turn, turn) <= all(largest_angle2));
}

// The mirror of a pose in the sensor frame: normal R S^-1 n, centre S^-1 (p - o).
STEPDIAG_INLINE void place_mirror(const SimdPass& pass, std::size_t row, std::size_t lane, Mirror& mirror,
                                  MaskPair& followed) {
    const SimdSetup& setup = *pass.setup;
    const ToolPose& pose = pass.poses[row];
    Vector3<Pair> normal = broadcast9<Pair>(pose.rotation) * at3(setup.mirror_normal, lane);
    Vector3<Pair> point = broadcast3<Pair>(pose.position);
    if (pass.displaced) point = point + at3(pass.displaced + 3 * row, lane);
    if (pass.turned) {
        const Vector3<Pair> turn = at3(pass.turned + 3 * row, lane);
        keep_small(turn, followed);
        normal = rotate(turn, normal);
    }
    const Matrix3<Pair> sensor_R_machine = at9(setup.sensor_R_machine, lane);
    mirror.normal = sensor_R_machine * normal;
    mirror.centre = sensor_R_machine * point + at3(setup.translation, lane);
}

STEPDIAG_INLINE MirrorReading<Pair> read(const Mirror& mirror) {
    return read_plane(mirror.centre, mirror.normal, all(1.0) / mirror.normal.z);
}

// L tan^2 phi
STEPDIAG_INLINE Pair excess_of(const Mirror& mirror) {
    const MirrorReading<Pair> reading = read(mirror);
    return reading.length * mul_add(reading.alpha, reading.alpha, reading.beta * reading.beta);
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
    const Pair distance = mul_add(all(beam.scale), light.optical_length, at(*beam.offset, lane));
    store(distance, to + lane);
    light.followed = both(light.followed, is_finite(distance));
    const SimdRow* const axis = beam.detector_rows;
    const Pair along = mul_add(at(axis[0], lane), light.direction[0],
                               mul_add(at(axis[1], lane), light.direction[1], at(axis[2], lane) * light.direction[2]));
    light.followed = both(light.followed, along <= all(-beam.least_cosine));
}

}  // namespace

// --- kernels ---

void trace(const SimdPass& pass, const Outline& outline, const std::vector<SimdBeam>& beams, double nearest) {
    const Pair gap = all(nearest);
    const Mirror::Met met{Event::reflected, true, &outline};
    Light<Pair> out[most_simd_beams];
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        MaskPair followed = all_true();
        for (std::size_t b = 0; b < beams.size(); ++b) {
            const SimdRow* const s = beams[b].source;
            out[b] = {{at(s[0], lane), at(s[1], lane), at(s[2], lane)},
                      {at(s[3], lane), at(s[4], lane), at(s[5], lane)},
                      all(0.0),
                      all(0.0),
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
                mirror.inverse_air = all(1.0);  // nobody asks for the reduced length
                meet(met, mirror, gap, light);
                if (beam.plates) through(*beam.plates, mirror.air, gap, light);
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
    const Pair zero = all(0.0), aside = all(0.25 * closed.aperture);
    const Pair half_mirror[2] = {all(closed.half_mirror[0]), all(closed.half_mirror[1])};
    const SimdRow* const axes = pass.setup->mirror_axes;
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const Pair ratio = at(*closed.index_ratio, lane);
        MaskPair followed = is_finite(ratio);  // else the air is out of its equation's range
        for (std::size_t row = 0; row < pass.rows; ++row) {
            Mirror mirror{*pass.setup, lane, {}, {}, {}, {}};
            place_mirror(pass, row, lane, mirror, followed);
            if (pass.excess) store(excess_of(mirror), pass.excess[row].value + lane);
            const MirrorReading<Pair> reading = read(mirror);
            followed = both(followed, both(both(mirror.normal.z > zero, reading.w > zero), reading.length > zero));
            // The beam from (u, v) meets the mirror's plane at (u, v, alpha v - beta u) and a constant.
            Pair along[2][2];
            for (int axis = 0; axis < 2; ++axis) {
                const Pair z = at(axes[3 * axis + 2], lane);
                along[axis][0] = sub_mul(z, reading.beta, at(axes[3 * axis], lane));
                along[axis][1] = mul_add(z, reading.alpha, at(axes[3 * axis + 1], lane));
            }
            const Pair tilt = magnitude(reading.alpha) + magnitude(reading.beta);  // at least the larger one
            const auto check = [&](Pair u, Pair v, Pair distance) HWY_ATTR {
                const Pair x = u - mirror.centre.x, y = v - mirror.centre.y;
                for (int axis = 0; axis < 2; ++axis) {
                    const Pair met = mul_add(along[axis][0], x, along[axis][1] * y);
                    followed = both(followed, magnitude(met) <= half_mirror[axis]);
                }
                followed = both(followed, both(distance > zero, distance * tilt <= aside));
            };
            double* const to = pass.readings + row * pass.channels * lane_group + lane;
            if (closed.layout == HeadLayout::multi_beam) {
                for (std::size_t i = 0; i < pass.channels; ++i) {
                    const Pair u = at(closed.beams[2 * i], lane), v = at(closed.beams[2 * i + 1], lane);
                    const Pair distance = beam_distance(reading, beam_arm(reading, u, v));
                    check(u, v, distance);
                    store(distance * ratio, to + i * lane_group);
                }
                continue;
            }
            check(zero, zero, reading.distance);
            store(reading.distance * ratio, to);
            if (closed.layout == HeadLayout::psd) {
                const Pair lever = spot_lever(reading, zero, at(*closed.psd_distance, lane));
                store(negative(lever * reading.beta), to + lane_group);
                store(lever * reading.alpha, to + 2 * lane_group);
            } else {
                store(reading.alpha, to + lane_group);
                store(reading.beta, to + 2 * lane_group);
            }
        }
        keep(followed, pass.followed + lane);
    }
}

void place_head_and_mirror(const LineFrame& line, const SimdRow* fields, SimdSetup& setup,
                           std::uint8_t* followed_lanes) {
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const auto number = [&](int k) HWY_ATTR { return at(fields[k], lane); };
        const auto pair = [&](int k) HWY_ATTR { return Vector3<Pair>{number(k), number(k + 1), all(0.0)}; };
        const auto put = [&](const Vector3<Pair>& v, SimdRow* to) HWY_ATTR {
            store(v.x, to[0].value + lane), store(v.y, to[1].value + lane), store(v.z, to[2].value + lane);
        };
        const Placing<Pair> placing{pair(setup::reflector),
                                    pair(setup::laser),
                                    {all(0.0), all(0.0), number(setup::roll)},
                                    pair(setup::lateral)};
        MaskPair followed = all_true();
        keep_small(placing.reflector, followed), keep_small(placing.laser, followed),
            keep_small(placing.roll, followed);
        const Placed<Pair> placed = place_setup(broadcast9<Pair>(line.frame), broadcast3<Pair>(line.origin), placing);
        const Matrix3<Pair> sensor_R_machine = transpose(placed.machine_R_sensor);
        const Matrix3<Pair> mirror_axes = transpose(placed.tool_R_mirror);
        put(sensor_R_machine.row0, setup.sensor_R_machine);
        put(sensor_R_machine.row1, setup.sensor_R_machine + 3);
        put(sensor_R_machine.row2, setup.sensor_R_machine + 6);
        put(-(sensor_R_machine * placed.origin), setup.translation);
        put(mirror_axes.row2, setup.mirror_normal);
        put(sensor_R_machine * mirror_axes.row0, setup.mirror_axes);
        put(sensor_R_machine * mirror_axes.row1, setup.mirror_axes + 3);
        keep(followed, followed_lanes + lane);
    }
}

void correct(const SimdPass& pass, const SimdCorrection& c) {
    for (std::size_t lane = 0; lane < lane_group; lane += 2 * hn::Lanes(Tag())) {
        const Pair drift = at(*c.drift, lane), model = at(*c.model, lane), w = at(*c.wavelength, lane);
        const Pair factor = at(*c.factor, lane), length = at(*c.length, lane), gain = at(*c.gain, lane);
        for (std::size_t row = 0; row < pass.rows; ++row) {
            Pair added = drift * all(c.elapsed[row]);
            if (pass.excess) added = mul_add(model, at(pass.excess[row], lane), added);
            const Pair scaled = mul_add(factor, all(c.travel[row]), length * all(c.length_share[row]));
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
    const Pair factor = all(spread), constant = all(expectation);
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
