// A point's channels from its length and tilts, and forces on them back again, with a lane for each set of readings
// (simd_model.hpp). After simd_rotation-inl.hpp.
#if defined(STEPDIAG_SIMD_CHANNELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_SIMD_CHANNELS_INL
#undef STEPDIAG_SIMD_CHANNELS_INL
#else
#define STEPDIAG_SIMD_CHANNELS_INL
#endif

#include "batch/simd_model.hpp"
#include "batch/simd_rotation-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// What is kept of a node and of a set-up, in vectors.
enum NodePart : int { node_rotation = 0, node_shift = 9, node_turn_pull = 12, node_shift_pull = 15, node_parts = 18 };
enum SetupPart : int {
    sensor = 0,
    beam_origin = 9,
    mirror_normal = 12,
    normal_pull = 15,
    sensor_pull = 18,
    origin_pull = 21,
    setup_columns = 24,  // the unknowns, then what pulls at those that are no angles nor lateral
};

// One vector of lanes of one problem: where its numbers are.
struct Chunk {
    const SimdProblem& problem;
    const SimdModel::At& at;
    std::size_t lane;
    double* nodes;
    double* setups;
    Vector largest_turn;  // its square

    HWY_INLINE double* node(int index) const { return nodes + std::size_t(index) * node_parts * hn::Lanes(Tag()); }
    HWY_INLINE double* setup(int index) const {
        return setups + std::size_t(index) * (setup_columns + 2 * problem.setup_size) * hn::Lanes(Tag());
    }
    HWY_INLINE Vector unknown(int index) const { return hn::LoadU(Tag(), at.x + place(index)); }
    HWY_INLINE void pull(int index, Vector force) const {
        double* to = at.pulled + place(index);
        hn::StoreU(hn::Add(hn::LoadU(Tag(), to), force), Tag(), to);
    }
    // Puts the residual of a channel that the model says reads `value`; gives the force of its s.
    HWY_INLINE Vector force(const SimdProblem::Channel& channel, Vector value) const {
        const Vector read = hn::LoadU(Tag(), at.readings + std::size_t(channel.input) * at.stride + lane);
        const Vector weight = hn::Set(Tag(), channel.weight);
        hn::StoreU(hn::Mul(weight, hn::Sub(read, value)), Tag(), at.r + place(channel.reading));
        return hn::Mul(weight, hn::LoadU(Tag(), at.s + place(channel.reading)));
    }
    HWY_INLINE std::size_t place(int index) const { return std::size_t(index) * lane_group + lane; }
};

HWY_INLINE Vector part(const double* from, int index) { return hn::LoadU(Tag(), from + index * hn::Lanes(Tag())); }
HWY_INLINE Vector3 part3(const double* from, int index) {
    return {part(from, index), part(from, index + 1), part(from, index + 2)};
}
HWY_INLINE Matrix3 part9(const double* from, int index) {
    return {part3(from, index), part3(from, index + 3), part3(from, index + 6)};
}
HWY_INLINE void put(double* to, int index, Vector value) { hn::StoreU(value, Tag(), to + index * hn::Lanes(Tag())); }
HWY_INLINE void put3(double* to, int index, const Vector3& value) {
    put(to, index, value.x), put(to, index + 1, value.y), put(to, index + 2, value.z);
}
HWY_INLINE void put9(double* to, int index, const Matrix3& value) {
    put3(to, index, value.row0), put3(to, index + 3, value.row1), put3(to, index + 6, value.row2);
}
HWY_INLINE void add(double* to, int index, Vector value) { put(to, index, hn::Add(part(to, index), value)); }
HWY_INLINE void add3(double* to, int index, const Vector3& value) { put3(to, index, part3(to, index) + value); }

// A point's length and tilts, and what its channels pull at them.
struct Tilt {
    Vector length, alpha, beta;
    Vector length_pull, alpha_pull, beta_pull;
};

// The channels of a point (ChannelModel::read_channels) and back again.
class Channels {
public:
    HWY_INLINE Channels(const Chunk& chunk, const SimdProblem::Point& point, double* setup, Tilt& tilt)
        : chunk_(chunk), point_(point), setup_(setup), pulls_(setup_columns + chunk.problem.setup_size), tilt_(tilt) {
        const Vector one = hn::Set(Tag(), 1.0);
        w_ = hn::NegMulAdd(tilt.alpha, tilt.alpha, hn::NegMulAdd(tilt.beta, tilt.beta, one));
        inverse_w_ = hn::Div(one, w_);
        scale_ = hn::Add(one, value(setup::gain));
        constant_ = hn::MulAdd(value(setup::drift), hn::Set(Tag(), point.time), value(setup::distance_constant));
        constant_ = hn::MulAdd(value(setup::scale_factor), hn::Set(Tag(), point.travel), constant_);
        tilt_.length_pull = tilt_.alpha_pull = tilt_.beta_pull = hn::Zero(Tag());
    }

    // `beam`: number of d1 ... dn, from 0.
    HWY_INLINE void pull_distance(const SimdProblem::Channel& channel, const Eigen::Vector2d& offset, int beam) {
        const Vector x = hn::Set(Tag(), offset.x()), y = hn::Set(Tag(), offset.y());
        const Vector arm = hn::MulSub(tilt_.alpha, y, hn::Mul(tilt_.beta, x));
        const Vector q = hn::Mul(hn::MulAdd(scale_, arm, tilt_.length), inverse_w_);
        Vector read = hn::Add(q, constant_);
        if (beam > 0) read = hn::Add(read, value(setup::beam_constants + beam));
        const Vector force = chunk_.force(channel, read);
        const Vector by_w = hn::Mul(force, inverse_w_), twice = hn::Add(q, q);
        tilt_.length_pull = hn::Add(tilt_.length_pull, by_w);
        tilt_.alpha_pull = hn::MulAdd(by_w, hn::MulAdd(scale_, y, hn::Mul(twice, tilt_.alpha)), tilt_.alpha_pull);
        tilt_.beta_pull = hn::MulAdd(by_w, hn::MulSub(twice, tilt_.beta, hn::Mul(scale_, x)), tilt_.beta_pull);
        pull(setup::distance_constant, force);
        pull(setup::drift, hn::Mul(force, hn::Set(Tag(), point_.time)));
        pull(setup::scale_factor, hn::Mul(force, hn::Set(Tag(), point_.travel)));
        pull(setup::gain, hn::Mul(by_w, arm));
        if (beam > 0) pull(setup::beam_constants + beam, force);
    }

    HWY_INLINE void pull_tilt(const SimdProblem::Channel& channel, Vector tilt, Vector& tilt_pull) {
        const Vector force = chunk_.force(channel, hn::Mul(scale_, tilt));
        tilt_pull = hn::MulAdd(force, scale_, tilt_pull);
        pull(setup::gain, hn::Mul(force, tilt));
    }

    // spot = scale lever (-beta, alpha) + zero, lever = 2 beyond/w
    HWY_INLINE void pull_spot(const SimdProblem::Channel* x, const SimdProblem::Channel* y,
                              const HeadCalibration& head) {
        const Vector bx = hn::Set(Tag(), head.spot_beam.x()), by = hn::Set(Tag(), head.spot_beam.y());
        const Vector arm = hn::MulSub(tilt_.alpha, by, hn::Mul(tilt_.beta, bx));
        const Vector beyond = hn::Add(hn::Add(tilt_.length, hn::Set(Tag(), *head.psd_distance)), arm);
        const Vector twice_by_w = hn::Add(inverse_w_, inverse_w_), lever = hn::Mul(beyond, twice_by_w);
        const Vector zero = hn::Zero(Tag());
        Vector force_x = zero, force_y = zero;
        const Vector scaled = hn::Mul(scale_, lever);
        if (x) force_x = chunk_.force(*x, hn::NegMulAdd(scaled, tilt_.beta, value(setup::psd_zero)));
        if (y) force_y = chunk_.force(*y, hn::MulAdd(scaled, tilt_.alpha, value(setup::psd_zero + 1)));
        pull(setup::psd_zero, force_x);
        pull(setup::psd_zero + 1, force_y);
        // How much the spot moves outwards: what pulls at the lever, and at the gain.
        const Vector outwards = hn::MulSub(force_y, tilt_.alpha, hn::Mul(force_x, tilt_.beta));
        pull(setup::gain, hn::Mul(outwards, lever));
        const Vector lever_pull = hn::Mul(hn::Mul(outwards, scale_), twice_by_w);
        const Vector twice_beyond = hn::Mul(hn::Add(beyond, beyond), inverse_w_);
        tilt_.length_pull = hn::Add(tilt_.length_pull, lever_pull);
        tilt_.alpha_pull = hn::MulAdd(lever_pull, hn::MulAdd(twice_beyond, tilt_.alpha, by), tilt_.alpha_pull);
        tilt_.beta_pull = hn::MulAdd(lever_pull, hn::MulSub(twice_beyond, tilt_.beta, bx), tilt_.beta_pull);
        tilt_.alpha_pull = hn::MulAdd(force_y, scaled, tilt_.alpha_pull);
        tilt_.beta_pull = hn::NegMulAdd(force_x, scaled, tilt_.beta_pull);
    }

private:
    HWY_INLINE Vector value(int column) const { return part(setup_, setup_columns + column); }
    HWY_INLINE void pull(int column, Vector force) { add(setup_, pulls_ + column, force); }

    const Chunk& chunk_;
    const SimdProblem::Point& point_;
    double* setup_;
    int pulls_;
    Tilt& tilt_;
    Vector w_, inverse_w_, scale_, constant_;
};

HWY_INLINE void pull_channels(const Chunk& chunk, const SimdProblem::Point& point, double* setup, Tilt& tilt) {
    Channels channels(chunk, point, setup, tilt);
    const SimdProblem::Channel* of = chunk.problem.of_points.data() + point.first_channel;
    const HeadCalibration& head = *chunk.problem.setups[point.setup].head;
    const auto there = [&](int i) { return of[i].reading != SimdProblem::no_reading; };
    if (chunk.problem.kind == HeadLayout::multi_beam) {
        for (int i = 0; i < chunk.problem.channels; ++i)
            if (there(i)) channels.pull_distance(of[i], head.beam_offsets[i], i);
        return;
    }
    if (there(0)) channels.pull_distance(of[0], Eigen::Vector2d::Zero(), 0);
    if (chunk.problem.kind == HeadLayout::ideal) {
        if (there(1)) channels.pull_tilt(of[1], tilt.alpha, tilt.alpha_pull);
        if (there(2)) channels.pull_tilt(of[2], tilt.beta, tilt.beta_pull);
    } else if (there(1) || there(2)) {
        channels.pull_spot(there(1) ? of + 1 : nullptr, there(2) ? of + 2 : nullptr, head);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
