#include "evaluation/lane_model.hpp"

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
#define HWY_TARGET_INCLUDE "evaluation/lane_model.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "evaluation/lane_rotation-inl.hpp"

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
    const LaneProblem& problem;
    const LaneModel::At& at;
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
    HWY_INLINE Vector force(const LaneProblem::Channel& channel, Vector value) const {
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

void prepare_nodes(Chunk& chunk) {
    for (std::size_t n = 0; n < chunk.problem.nodes.size(); ++n) {
        const LaneProblem::Node& node = chunk.problem.nodes[n];
        const auto unknown = [&](int c) HWY_ATTR { return chunk.unknown(node.unknown[c]); };
        const Vector3 turn{unknown(3), unknown(4), unknown(5)};
        const Vector angle2 = dot(turn, turn);
        chunk.largest_turn = hn::Max(chunk.largest_turn, angle2);
        double* to = chunk.node(int(n));
        put9(to, node_rotation, rotation_exp(turn, angle2));
        put3(to, node_shift, Vector3{unknown(0), unknown(1), unknown(2)} + common3(node.position.data()));
        for (int k = node_turn_pull; k < node_parts; ++k) put(to, k, hn::Zero(Tag()));
    }
}

struct SetupAngles {
    Vector3 reflector, laser, roll;
};

HWY_INLINE SetupAngles angles_of(const double* from) {
    const Vector zero = hn::Zero(Tag());
    const auto value = [&](int column) HWY_ATTR { return part(from, setup_columns + column); };
    return {{value(setup::reflector), value(setup::reflector + 1), zero},
            {value(setup::laser), value(setup::laser + 1), zero},
            {zero, zero, value(setup::roll)}};
}

void prepare_setups(Chunk& chunk) {
    for (std::size_t s = 0; s < chunk.problem.setups.size(); ++s) {
        const LaneProblem::Setup& setup = chunk.problem.setups[s];
        double* to = chunk.setup(int(s));
        for (int c = 0; c < chunk.problem.setup_size; ++c) {
            const bool there = c < int(setup.unknown.size());
            put(to, setup_columns + c, there ? chunk.unknown(setup.unknown[c]) : hn::Zero(Tag()));
            put(to, setup_columns + chunk.problem.setup_size + c, hn::Zero(Tag()));
        }
        for (int k = normal_pull; k < setup_columns; ++k) put(to, k, hn::Zero(Tag()));
        const SetupAngles angles = angles_of(to);
        Vector angle2[3] = {dot(angles.reflector, angles.reflector), dot(angles.laser, angles.laser),
                            dot(angles.roll, angles.roll)};
        for (const Vector each : angle2) chunk.largest_turn = hn::Max(chunk.largest_turn, each);

        const Matrix3 line = common9(setup.machine_R_line);
        const Matrix3 mirror = rotation_exp(angles.reflector, angle2[0]);
        put3(to, mirror_normal, line * Vector3{mirror.row0.z, mirror.row1.z, mirror.row2.z});
        put9(to, sensor, line * (rotation_exp(angles.laser, angle2[1]) * rotation_exp(angles.roll, angle2[2])));
        const Vector3 lateral{part(to, setup_columns + setup::lateral), part(to, setup_columns + setup::lateral + 1),
                              hn::Zero(Tag())};
        put3(to, beam_origin, line * lateral + common3(setup.origin.data()));
    }
}

// A point's length and tilts, and what its channels pull at them.
struct Tilt {
    Vector length, alpha, beta;
    Vector length_pull, alpha_pull, beta_pull;
};

// The channels of a point (ChannelModel::read_channels) and back again.
class Channels {
public:
    HWY_INLINE Channels(const Chunk& chunk, const LaneProblem::Point& point, double* setup, Tilt& tilt)
        : chunk_(chunk), point_(point), setup_(setup), pulls_(setup_columns + chunk.problem.setup_size), tilt_(tilt) {
        const Vector one = hn::Set(Tag(), 1.0);
        w_ = hn::NegMulAdd(tilt.alpha, tilt.alpha, hn::NegMulAdd(tilt.beta, tilt.beta, one));
        inverse_w_ = hn::Div(one, w_);
        scale_ = hn::Add(one, value(setup::gain));
        constant_ = hn::MulAdd(value(setup::drift), hn::Set(Tag(), point.time), value(setup::distance_constant));
        constant_ = hn::NegMulAdd(value(setup::cosine), hn::Set(Tag(), point.travel), constant_);
        tilt_.length_pull = tilt_.alpha_pull = tilt_.beta_pull = hn::Zero(Tag());
    }

    // `beam`: number of d1 ... dn, from 0.
    HWY_INLINE void pull_distance(const LaneProblem::Channel& channel, const Eigen::Vector2d& offset, int beam) {
        const Vector x = hn::Set(Tag(), offset.x()), y = hn::Set(Tag(), offset.y());
        const Vector arm = hn::MulSub(tilt_.alpha, y, hn::Mul(tilt_.beta, x));
        const Vector q = hn::Mul(hn::MulAdd(scale_, arm, tilt_.length), inverse_w_);
        Vector read = hn::Add(q, constant_);
        if (beam > 0) read = hn::Add(read, value(setup::beam_constants + beam - 1));
        const Vector force = chunk_.force(channel, read);
        const Vector by_w = hn::Mul(force, inverse_w_), twice = hn::Add(q, q);
        tilt_.length_pull = hn::Add(tilt_.length_pull, by_w);
        tilt_.alpha_pull = hn::MulAdd(by_w, hn::MulAdd(scale_, y, hn::Mul(twice, tilt_.alpha)), tilt_.alpha_pull);
        tilt_.beta_pull = hn::MulAdd(by_w, hn::MulSub(twice, tilt_.beta, hn::Mul(scale_, x)), tilt_.beta_pull);
        pull(setup::distance_constant, force);
        pull(setup::drift, hn::Mul(force, hn::Set(Tag(), point_.time)));
        pull(setup::cosine, hn::Mul(force, hn::Set(Tag(), -point_.travel)));
        pull(setup::gain, hn::Mul(by_w, arm));
        if (beam > 0) pull(setup::beam_constants + beam - 1, force);
    }

    HWY_INLINE void pull_tilt(const LaneProblem::Channel& channel, Vector tilt, Vector& tilt_pull) {
        const Vector force = chunk_.force(channel, hn::Mul(scale_, tilt));
        tilt_pull = hn::MulAdd(force, scale_, tilt_pull);
        pull(setup::gain, hn::Mul(force, tilt));
    }

    // spot = scale lever (-beta, alpha) + zero, lever = 2 beyond/w
    HWY_INLINE void pull_spot(const LaneProblem::Channel* x, const LaneProblem::Channel* y,
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
    const LaneProblem::Point& point_;
    double* setup_;
    int pulls_;
    Tilt& tilt_;
    Vector w_, inverse_w_, scale_, constant_;
};

HWY_INLINE void pull_channels(const Chunk& chunk, const LaneProblem::Point& point, double* setup, Tilt& tilt) {
    Channels channels(chunk, point, setup, tilt);
    const LaneProblem::Channel* of = chunk.problem.of_points.data() + point.first_channel;
    const HeadCalibration& head = *chunk.problem.setups[point.setup].head;
    const auto there = [&](int i) { return of[i].reading != LaneProblem::no_reading; };
    if (chunk.problem.kind == ChannelKind::multi_beam) {
        for (int i = 0; i < chunk.problem.channels; ++i)
            if (there(i)) channels.pull_distance(of[i], head.beam_offsets[i], i);
        return;
    }
    if (there(0)) channels.pull_distance(of[0], Eigen::Vector2d::Zero(), 0);
    if (chunk.problem.kind == ChannelKind::ideal) {
        if (there(1)) channels.pull_tilt(of[1], tilt.alpha, tilt.alpha_pull);
        if (there(2)) channels.pull_tilt(of[2], tilt.beta, tilt.beta_pull);
    } else if (there(1) || there(2)) {
        channels.pull_spot(there(1) ? of + 1 : nullptr, there(2) ? of + 2 : nullptr, head);
    }
}

// A force on the functional point and one on the normal's tip.
struct MirrorPull {
    Vector3 point, normal;
};

// From the mirror's pose to the readings and back (ChannelModel::read).
HWY_INLINE MirrorPull pull_mirror(const Chunk& chunk, const LaneProblem::Point& point, const Vector3& position,
                                  const Vector3& normal) {
    double* setup = chunk.setup(point.setup);
    const Matrix3 machine_R_sensor = part9(setup, sensor);
    const Vector3 q = transposed_product(machine_R_sensor, position - part3(setup, beam_origin));
    const Vector3 m = transposed_product(machine_R_sensor, normal);
    const Vector inverse = hn::Div(hn::Set(Tag(), 1.0), m.z);
    Tilt tilt;
    tilt.beta = hn::Mul(m.x, inverse);
    tilt.alpha = hn::Neg(hn::Mul(m.y, inverse));
    tilt.length = hn::MulAdd(tilt.beta, q.x, hn::NegMulAdd(tilt.alpha, q.y, q.z));
    pull_channels(chunk, point, setup, tilt);

    const Vector beta_pull = hn::MulAdd(tilt.length_pull, q.x, tilt.beta_pull);
    const Vector alpha_pull = hn::NegMulAdd(tilt.length_pull, q.y, tilt.alpha_pull);
    const Vector3 q_pull{hn::Mul(tilt.length_pull, tilt.beta), hn::Neg(hn::Mul(tilt.length_pull, tilt.alpha)),
                         tilt.length_pull};
    const Vector m_by_z = hn::MulAdd(beta_pull, tilt.beta, hn::Mul(alpha_pull, tilt.alpha));
    const Vector3 m_pull{hn::Mul(beta_pull, inverse), hn::Neg(hn::Mul(alpha_pull, inverse)),
                         hn::Neg(hn::Mul(m_by_z, inverse))};
    // The sensor turned sees everything turned the other way.
    add3(setup, sensor_pull, cross(q_pull, q) + cross(m_pull, m));
    const MirrorPull pull{machine_R_sensor * q_pull, machine_R_sensor * m_pull};
    put3(setup, origin_pull, part3(setup, origin_pull) - pull.point);
    return pull;
}

// Through the chain from the tool to the workpiece, and the forces back to the tool.
HWY_INLINE void pull_point(const Chunk& chunk, const LaneProblem::Point& point) {
    const LaneProblem& problem = chunk.problem;
    double* setup = chunk.setup(point.setup);
    Vector3 position = common3(problem.tool.data());
    Vector3 normal = part3(setup, mirror_normal);
    Vector3 position_arm[3], normal_arm[3];  // what turns with an axis
    for (int place = 2; place >= 0; --place) {
        const double* node = chunk.node(point.node[place]);
        const Matrix3 rotation = part9(node, node_rotation);
        const Vector3 shift = part3(node, node_shift);
        normal = normal_arm[place] = rotation * normal;
        if (problem.carries_workpiece[place]) {
            position = position_arm[place] = rotation * (position + shift);
        } else {
            position_arm[place] = rotation * position;
            position = position_arm[place] + shift;
        }
    }
    MirrorPull pull = pull_mirror(chunk, point, position, normal);
    for (int place = 0; place < 3; ++place) {
        double* node = chunk.node(point.node[place]);
        const Matrix3 rotation = part9(node, node_rotation);
        add3(node, node_turn_pull, cross(position_arm[place], pull.point) + cross(normal_arm[place], pull.normal));
        if (!problem.carries_workpiece[place]) add3(node, node_shift_pull, pull.point);
        pull = {transposed_product(rotation, pull.point), transposed_product(rotation, pull.normal)};
        if (problem.carries_workpiece[place]) add3(node, node_shift_pull, pull.point);
    }
    add3(setup, normal_pull, pull.normal);
}

void finish_nodes(const Chunk& chunk) {
    for (std::size_t n = 0; n < chunk.problem.nodes.size(); ++n) {
        const auto& unknown = chunk.problem.nodes[n].unknown;
        const double* from = chunk.node(int(n));
        const Vector3 shift = part3(from, node_shift_pull);
        chunk.pull(unknown[0], shift.x), chunk.pull(unknown[1], shift.y), chunk.pull(unknown[2], shift.z);
        const Vector3 angles{chunk.unknown(unknown[3]), chunk.unknown(unknown[4]), chunk.unknown(unknown[5])};
        const Vector3 turn = transposed_jacobian(angles, dot(angles, angles), part3(from, node_turn_pull));
        chunk.pull(unknown[3], turn.x), chunk.pull(unknown[4], turn.y), chunk.pull(unknown[5], turn.z);
    }
}

void finish_setups(const Chunk& chunk) {
    for (std::size_t s = 0; s < chunk.problem.setups.size(); ++s) {
        const LaneProblem::Setup& setup = chunk.problem.setups[s];
        double* at = chunk.setup(int(s));
        const int pulls = setup_columns + chunk.problem.setup_size;
        const SetupAngles angles = angles_of(at);
        const Matrix3 line = common9(setup.machine_R_line);

        const Vector3 normal = transposed_product(line, part3(at, mirror_normal));
        const Vector3 torque = cross(normal, transposed_product(line, part3(at, normal_pull)));
        const Vector3 reflector =
            transposed_jacobian(angles.reflector, dot(angles.reflector, angles.reflector), torque);
        put(at, pulls + setup::reflector, reflector.x), put(at, pulls + setup::reflector + 1, reflector.y);

        const Vector3 sensor_torque = part3(at, sensor_pull);
        const Vector3 unrolled = rotation_exp(angles.roll, dot(angles.roll, angles.roll)) * sensor_torque;
        // Exp(v + dv) = Exp(v) Exp(J(v)^T dv), and J(v)^T = J(-v).
        const Vector3 laser = transposed_jacobian(-angles.laser, dot(angles.laser, angles.laser), unrolled);
        put(at, pulls + setup::laser, laser.x), put(at, pulls + setup::laser + 1, laser.y);
        put(at, pulls + setup::roll, sensor_torque.z);

        const Vector3 lateral = transposed_product(line, part3(at, origin_pull));
        put(at, pulls + setup::lateral, lateral.x), put(at, pulls + setup::lateral + 1, lateral.y);
        for (std::size_t c = 0; c < setup.unknown.size(); ++c) chunk.pull(setup.unknown[c], part(at, pulls + int(c)));
    }
}

void evaluate_lanes(const LaneProblem& problem, const LaneModel::At& at, double* scratch) {
    const std::size_t width = hn::Lanes(Tag());
    double* const setups = scratch + problem.nodes.size() * node_parts * width;
    for (std::size_t lane = 0; lane < lane_group; lane += width) {
        Chunk chunk{problem, at, lane, scratch, setups, hn::Zero(Tag())};
        prepare_nodes(chunk);
        prepare_setups(chunk);
        for (const LaneProblem::Point& point : problem.points) pull_point(chunk, point);
        finish_nodes(chunk);
        finish_setups(chunk);
        double largest[widest_vector];
        hn::StoreU(chunk.largest_turn, Tag(), largest);
        for (std::size_t i = 0; i < width; ++i) at.is_valid[lane + i] = largest[i] <= largest_angle2;
    }
}

std::size_t scratch_numbers(const LaneProblem& problem) {
    return hn::Lanes(Tag()) *
           (problem.nodes.size() * node_parts + problem.setups.size() * (setup_columns + 2 * problem.setup_size));
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(evaluate_lanes);
HWY_EXPORT(scratch_numbers);

}  // namespace

LaneModel::LaneModel(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input)
    : problem_(problem, input), scratch_(std::ptrdiff_t(HWY_DYNAMIC_DISPATCH(scratch_numbers)(problem_))) {}

void LaneModel::evaluate(const At& at) {
    std::fill_n(at.pulled, lane_group * std::size_t(problem_.unknowns + 1), 0.0);
    HWY_DYNAMIC_DISPATCH(evaluate_lanes)(problem_, at, scratch_.data());
}

}  // namespace stepdiag
#endif  // HWY_ONCE
