// Computes the channels of a point from its length and tilts, and carries forces on channels back, with one set of
// readings in each lane (simd_model.hpp).
#if defined(STEPDIAG_SIMD_CHANNELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_SIMD_CHANNELS_INL
#undef STEPDIAG_SIMD_CHANNELS_INL
#else
#define STEPDIAG_SIMD_CHANNELS_INL
#endif

#include "batch/simd_model.hpp"
// First the vectors, because the following text is compiled for them:
#include "core/simd-inl.hpp"
//
#include "measurement/reading-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

using Lanes3 = Vector3<Vector>;
using Lanes9 = Matrix3<Vector>;

// Vectors kept for each node and for each set-up.
enum NodePart : int { node_rotation = 0, node_shift = 9, node_turn_pull = 12, node_shift_pull = 15, node_parts = 18 };
enum SetupPart : int {
    sensor = 0,
    beam_origin = 9,
    mirror_normal = 12,
    normal_pull = 15,
    sensor_pull = 18,
    origin_pull = 21,
    setup_columns = 24,  // the unknowns, then their pulls, without angles and lateral
};

// One vector of lanes of a problem: where its numbers are stored.
struct Chunk {
    const SimdProblem& problem;
    const SimdModel::At& at;
    std::size_t lane;
    double* nodes;
    double* setups;
    Vector largest_turn;  // squared

    STEPDIAG_INLINE double* node(int index) const { return nodes + std::size_t(index) * node_parts * hn::Lanes(Tag()); }
    STEPDIAG_INLINE double* setup(int index) const {
        return setups + std::size_t(index) * (setup_columns + 2 * problem.setup_size) * hn::Lanes(Tag());
    }
    STEPDIAG_INLINE Vector unknown(int index) const { return hn::LoadU(Tag(), at.x + place(index)); }
    STEPDIAG_INLINE void pull(int index, Vector force) const {
        double* to = at.pulled + place(index);
        hn::StoreU(hn::Add(hn::LoadU(Tag(), to), force), Tag(), to);
    }
    // Stores the residual of a channel whose modelled reading is `value`; returns the force of its s.
    STEPDIAG_INLINE Vector force(const SimdProblem::Channel& channel, Vector value) const {
        const Vector read = hn::LoadU(Tag(), at.readings + std::size_t(channel.input) * at.stride + lane);
        const Vector weight = hn::Set(Tag(), channel.weight);
        hn::StoreU(hn::Mul(weight, hn::Sub(read, value)), Tag(), at.r + place(channel.reading));
        return hn::Mul(weight, hn::LoadU(Tag(), at.s + place(channel.reading)));
    }
    STEPDIAG_INLINE std::size_t place(int index) const { return std::size_t(index) * lane_group + lane; }
};

STEPDIAG_INLINE Vector part(const double* from, int index) { return hn::LoadU(Tag(), from + index * hn::Lanes(Tag())); }
STEPDIAG_INLINE Lanes3 part3(const double* from, int index) {
    return {part(from, index), part(from, index + 1), part(from, index + 2)};
}
STEPDIAG_INLINE Lanes9 part9(const double* from, int index) {
    return {part3(from, index), part3(from, index + 3), part3(from, index + 6)};
}
STEPDIAG_INLINE void put(double* to, int index, Vector value) {
    hn::StoreU(value, Tag(), to + index * hn::Lanes(Tag()));
}
STEPDIAG_INLINE void put3(double* to, int index, const Lanes3& value) {
    put(to, index, value.x), put(to, index + 1, value.y), put(to, index + 2, value.z);
}
STEPDIAG_INLINE void put9(double* to, int index, const Lanes9& value) {
    put3(to, index, value.row0), put3(to, index + 3, value.row1), put3(to, index + 6, value.row2);
}
STEPDIAG_INLINE void add(double* to, int index, Vector value) { put(to, index, hn::Add(part(to, index), value)); }
STEPDIAG_INLINE void add3(double* to, int index, const Lanes3& value) { put3(to, index, part3(to, index) + value); }

// Pull of a point's channels on its length and tilts.
struct TiltPull {
    Vector length, alpha, beta;
};

// The channels of a point (ChannelModel::read_channels), and the way back.
class Channels {
public:
    STEPDIAG_INLINE Channels(const Chunk& chunk, const SimdProblem::Point& point, double* setup,
                             const MirrorReading<Vector>& mirror)
        : chunk_(chunk),
          point_(point),
          setup_(setup),
          pulls_(setup_columns + chunk.problem.setup_size),
          mirror_(mirror) {
        scale_ = hn::Set(Tag(), 1.0) + value(setup::gain);
        added_ = distance_added(value(setup::distance_constant), value(setup::drift), hn::Set(Tag(), point.time),
                                value(setup::scale_factor), hn::Set(Tag(), point.travel));
    }
    const TiltPull& tilt_pull() const { return tilt_; }

    // `beam`: number of the beam d1 ... dn, from 0.
    STEPDIAG_INLINE void pull_distance(const SimdProblem::Channel& channel, const Eigen::Vector2d& offset, int beam) {
        const Vector x = hn::Set(Tag(), offset.x()), y = hn::Set(Tag(), offset.y());
        const Vector arm = beam_arm(mirror_, x, y), distance = beam_distance(mirror_, scale_ * arm);
        Vector read = distance + added_;
        if (beam > 0) read = read + value(setup::beam_constants + beam);
        const Vector force = chunk_.force(channel, read);
        const Vector by_w = force * mirror_.inverse_w, twice = distance + distance;
        tilt_.length = tilt_.length + by_w;
        tilt_.alpha = mul_add(by_w, mul_add(scale_, y, twice * mirror_.alpha), tilt_.alpha);
        tilt_.beta = mul_add(by_w, sub_mul(scale_, x, twice * mirror_.beta), tilt_.beta);
        pull(setup::distance_constant, force);
        pull(setup::drift, force * hn::Set(Tag(), point_.time));
        pull(setup::scale_factor, force * hn::Set(Tag(), point_.travel));
        pull(setup::gain, by_w * arm);
        if (beam > 0) pull(setup::beam_constants + beam, force);
    }

    STEPDIAG_INLINE void pull_alpha(const SimdProblem::Channel& channel) {
        tilt_.alpha = pull_tilt(channel, mirror_.alpha, tilt_.alpha);
    }
    STEPDIAG_INLINE void pull_beta(const SimdProblem::Channel& channel) {
        tilt_.beta = pull_tilt(channel, mirror_.beta, tilt_.beta);
    }

    STEPDIAG_INLINE void pull_spot(const SimdProblem::Channel* x, const SimdProblem::Channel* y,
                                   const HeadCalibration& head) {
        const Vector bx = hn::Set(Tag(), head.spot_beam.x()), by = hn::Set(Tag(), head.spot_beam.y());
        const Vector lever = spot_lever(mirror_, beam_arm(mirror_, bx, by), hn::Set(Tag(), *head.psd_distance));
        const Vector scaled = scale_ * lever;
        const auto spot = spot_reading(mirror_, scaled, value(setup::psd_zero), value(setup::psd_zero + 1));
        Vector force_x = hn::Zero(Tag()), force_y = hn::Zero(Tag());
        if (x) force_x = chunk_.force(*x, spot.x);
        if (y) force_y = chunk_.force(*y, spot.y);
        pull(setup::psd_zero, force_x);
        pull(setup::psd_zero + 1, force_y);
        // Outward movement of the spot, which pulls at the lever and at the gain.
        const Vector outwards = sub_mul(force_x, mirror_.beta, force_y * mirror_.alpha);
        pull(setup::gain, outwards * lever);
        const Vector lever_pull = outwards * scale_ * (mirror_.inverse_w + mirror_.inverse_w);
        tilt_.length = tilt_.length + lever_pull;
        tilt_.alpha = mul_add(lever_pull, mul_add(lever, mirror_.alpha, by), tilt_.alpha);
        tilt_.beta = mul_add(lever_pull, mul_add(lever, mirror_.beta, negative(bx)), tilt_.beta);
        tilt_.alpha = mul_add(force_y, scaled, tilt_.alpha);
        tilt_.beta = sub_mul(force_x, scaled, tilt_.beta);
    }

private:
    STEPDIAG_INLINE Vector pull_tilt(const SimdProblem::Channel& channel, Vector tilt, Vector sum) {
        const Vector force = chunk_.force(channel, scale_ * tilt);
        pull(setup::gain, force * tilt);
        return mul_add(force, scale_, sum);
    }
    STEPDIAG_INLINE Vector value(int column) const { return part(setup_, setup_columns + column); }
    STEPDIAG_INLINE void pull(int column, Vector force) { add(setup_, pulls_ + column, force); }

    const Chunk& chunk_;
    const SimdProblem::Point& point_;
    double* setup_;
    int pulls_;
    const MirrorReading<Vector>& mirror_;
    TiltPull tilt_ = {hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag())};
    Vector scale_, added_;
};

STEPDIAG_INLINE TiltPull pull_channels(const Chunk& chunk, const SimdProblem::Point& point, double* setup,
                                       const MirrorReading<Vector>& mirror) {
    Channels channels(chunk, point, setup, mirror);
    const SimdProblem::Channel* of = chunk.problem.of_points.data() + point.first_channel;
    const HeadCalibration& head = *chunk.problem.setups[point.setup].head;
    const auto there = [&](int i) { return of[i].reading != SimdProblem::no_reading; };
    if (chunk.problem.kind == HeadLayout::multi_beam) {
        for (int i = 0; i < chunk.problem.channels; ++i)
            if (there(i)) channels.pull_distance(of[i], head.beam_offsets[i], i);
        return channels.tilt_pull();
    }
    if (there(0)) channels.pull_distance(of[0], Eigen::Vector2d::Zero(), 0);
    if (chunk.problem.kind == HeadLayout::ideal) {
        if (there(1)) channels.pull_alpha(of[1]);
        if (there(2)) channels.pull_beta(of[2]);
    } else if (there(1) || there(2)) {
        channels.pull_spot(there(1) ? of + 1 : nullptr, there(2) ? of + 2 : nullptr, head);
    }
    return channels.tilt_pull();
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
