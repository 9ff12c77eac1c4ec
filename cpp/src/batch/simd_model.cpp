#include "batch/simd_model.hpp"

#include <algorithm>

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "batch/simd_model.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "batch/simd_channels-inl.hpp"
#include "machine/pose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

void prepare_nodes(Chunk& chunk) {
    for (std::size_t n = 0; n < chunk.problem.nodes.size(); ++n) {
        const SimdProblem::Node& node = chunk.problem.nodes[n];
        const auto unknown = [&](int c) HWY_ATTR { return chunk.unknown(node.unknown[c]); };
        const Lanes3 turn{unknown(3), unknown(4), unknown(5)};
        chunk.largest_turn = hn::Max(chunk.largest_turn, dot(turn, turn));
        double* to = chunk.node(int(n));
        put9(to, node_rotation, rotation_exp(turn));
        put3(to, node_shift, Lanes3{unknown(0), unknown(1), unknown(2)} + broadcast3<Vector>(node.position.data()));
        for (int k = node_turn_pull; k < node_parts; ++k) put(to, k, hn::Zero(Tag()));
    }
}

STEPDIAG_INLINE Placing<Vector> placing_of(const double* from) {
    const Vector zero = hn::Zero(Tag());
    const auto value = [&](int column) HWY_ATTR { return part(from, setup_columns + column); };
    return {{value(setup::reflector), value(setup::reflector + 1), zero},
            {value(setup::laser), value(setup::laser + 1), zero},
            {zero, zero, value(setup::roll)},
            {value(setup::lateral), value(setup::lateral + 1), zero}};
}

void prepare_setups(Chunk& chunk) {
    for (std::size_t s = 0; s < chunk.problem.setups.size(); ++s) {
        const SimdProblem::Setup& setup = chunk.problem.setups[s];
        double* to = chunk.setup(int(s));
        for (int c = 0; c < chunk.problem.setup_size; ++c) {
            const bool there = c < int(setup.unknown.size());
            put(to, setup_columns + c, there ? chunk.unknown(setup.unknown[c]) : hn::Zero(Tag()));
            put(to, setup_columns + chunk.problem.setup_size + c, hn::Zero(Tag()));
        }
        for (int k = normal_pull; k < setup_columns; ++k) put(to, k, hn::Zero(Tag()));
        const Placing<Vector> placing = placing_of(to);
        for (const Lanes3& angles : {placing.reflector, placing.laser, placing.roll})
            chunk.largest_turn = hn::Max(chunk.largest_turn, dot(angles, angles));
        const Placed<Vector> placed =
            place_setup(broadcast9<Vector>(setup.machine_R_line), broadcast3<Vector>(setup.origin), placing);
        put9(to, sensor, placed.machine_R_sensor);
        put3(to, beam_origin, placed.origin);
        put3(to, mirror_normal, transpose(placed.tool_R_mirror).row2);
    }
}

// Forces on the functional point and on the tip of the normal.
struct MirrorPull {
    Lanes3 point, normal;
};

// From the mirror's pose to the readings, and back (ChannelModel::read).
STEPDIAG_INLINE MirrorPull pull_mirror(const Chunk& chunk, const SimdProblem::Point& point, const Lanes3& position,
                                       const Lanes3& normal) {
    double* setup = chunk.setup(point.setup);
    const Lanes9 machine_R_sensor = part9(setup, sensor);
    const Lanes3 q = transposed_product(machine_R_sensor, position - part3(setup, beam_origin));
    const Lanes3 m = transposed_product(machine_R_sensor, normal);
    const Vector inverse = hn::Div(hn::Set(Tag(), 1.0), m.z);
    const MirrorReading<Vector> mirror = read_plane(q, m, inverse);
    const TiltPull pulled = pull_channels(chunk, point, setup, mirror);

    const Vector beta_pull = mul_add(pulled.length, q.x, pulled.beta);
    const Vector alpha_pull = sub_mul(pulled.length, q.y, pulled.alpha);
    const Lanes3 q_pull{pulled.length * mirror.beta, negative(pulled.length * mirror.alpha), pulled.length};
    const Vector m_by_z = mul_add(beta_pull, mirror.beta, alpha_pull * mirror.alpha);
    const Lanes3 m_pull{beta_pull * inverse, negative(alpha_pull * inverse), negative(m_by_z * inverse)};
    // A turn of the sensor acts like the opposite turn of everything it sees.
    add3(setup, sensor_pull, cross(q_pull, q) + cross(m_pull, m));
    const MirrorPull pull{machine_R_sensor * q_pull, machine_R_sensor * m_pull};
    put3(setup, origin_pull, part3(setup, origin_pull) - pull.point);
    return pull;
}

STEPDIAG_INLINE Vector& along(Lanes3& vector, int axis) {
    return axis == 0 ? vector.x : axis == 1 ? vector.y : vector.z;
}

// What expansion and drift add to an axis, and the force on that back to the coefficients.
STEPDIAG_INLINE void expand(const Chunk& chunk, const SimdProblem::Point& point, int axis, Lanes3& shift) {
    Vector& position = along(shift, axis);
    position = position + hn::Set(Tag(), point.expansion[axis]);
    for (const SimdProblem::Coefficient& of : chunk.problem.coefficients)
        if (std::find(of.axes.begin(), of.axes.end(), axis) != of.axes.end())
            position = mul_add(hn::Set(Tag(), of.effect(point, axis)), chunk.unknown(of.unknown), position);
}
STEPDIAG_INLINE void pull_expansion(const Chunk& chunk, const SimdProblem::Point& point, int axis, Lanes3 force) {
    for (const SimdProblem::Coefficient& of : chunk.problem.coefficients)
        if (std::find(of.axes.begin(), of.axes.end(), axis) != of.axes.end())
            chunk.pull(of.unknown, hn::Set(Tag(), of.effect(point, axis)) * along(force, axis));
}

// Follows the chain from the tool to the workpiece, and carries the forces back to the tool.
STEPDIAG_INLINE void pull_point(const Chunk& chunk, const SimdProblem::Point& point) {
    const SimdProblem& problem = chunk.problem;
    double* setup = chunk.setup(point.setup);
    Lanes3 position = broadcast3<Vector>(problem.tool);
    Lanes3 normal = part3(setup, mirror_normal);
    Lanes3 position_arm[3], normal_arm[3];  // vectors that turn with an axis
    for (int place = 2; place >= 0; --place) {
        const double* node = chunk.node(point.node[place]);
        Lanes3 shift = part3(node, node_shift);
        if (problem.moves_axes) expand(chunk, point, problem.axis[place], shift);
        const AxisMotion<Vector> axis{part9(node, node_rotation), shift, problem.carries_workpiece[place]};
        const MovedPoint<Vector> moved = move_point(axis, position);
        position_arm[place] = moved.arm, position = moved.point;
        normal = normal_arm[place] = axis.rotation * normal;
    }
    MirrorPull pull = pull_mirror(chunk, point, position, normal);
    for (int place = 0; place < 3; ++place) {
        double* node = chunk.node(point.node[place]);
        const Lanes9 rotation = part9(node, node_rotation);
        add3(node, node_turn_pull, cross(position_arm[place], pull.point) + cross(normal_arm[place], pull.normal));
        const MirrorPull inside = {transposed_product(rotation, pull.point), transposed_product(rotation, pull.normal)};
        const Lanes3 on_shift = problem.carries_workpiece[place] ? inside.point : pull.point;
        add3(node, node_shift_pull, on_shift);
        if (problem.moves_axes) pull_expansion(chunk, point, problem.axis[place], on_shift);
        pull = inside;
    }
    add3(setup, normal_pull, pull.normal);
}

void finish_nodes(const Chunk& chunk) {
    for (std::size_t n = 0; n < chunk.problem.nodes.size(); ++n) {
        const auto& unknown = chunk.problem.nodes[n].unknown;
        const double* from = chunk.node(int(n));
        const Lanes3 shift = part3(from, node_shift_pull);
        chunk.pull(unknown[0], shift.x), chunk.pull(unknown[1], shift.y), chunk.pull(unknown[2], shift.z);
        const Lanes3 angles{chunk.unknown(unknown[3]), chunk.unknown(unknown[4]), chunk.unknown(unknown[5])};
        const Lanes3 turn = transposed_jacobian(angles, part3(from, node_turn_pull));
        chunk.pull(unknown[3], turn.x), chunk.pull(unknown[4], turn.y), chunk.pull(unknown[5], turn.z);
    }
}

void finish_setups(const Chunk& chunk) {
    for (std::size_t s = 0; s < chunk.problem.setups.size(); ++s) {
        const SimdProblem::Setup& setup = chunk.problem.setups[s];
        double* at = chunk.setup(int(s));
        const int pulls = setup_columns + chunk.problem.setup_size;
        const Placing<Vector> angles = placing_of(at);
        const Lanes9 line = broadcast9<Vector>(setup.machine_R_line);

        const Lanes3 normal = transposed_product(line, part3(at, mirror_normal));
        const Lanes3 torque = cross(normal, transposed_product(line, part3(at, normal_pull)));
        const Lanes3 reflector = transposed_jacobian(angles.reflector, torque);
        put(at, pulls + setup::reflector, reflector.x), put(at, pulls + setup::reflector + 1, reflector.y);

        const Lanes3 sensor_torque = part3(at, sensor_pull);
        const Lanes3 unrolled = rotate(angles.roll, sensor_torque);
        // Exp(v + dv) = Exp(v) Exp(J(v)^T dv), and J(v)^T = J(-v).
        const Lanes3 laser = transposed_jacobian(-angles.laser, unrolled);
        put(at, pulls + setup::laser, laser.x), put(at, pulls + setup::laser + 1, laser.y);
        put(at, pulls + setup::roll, sensor_torque.z);

        const Lanes3 lateral = transposed_product(line, part3(at, origin_pull));
        put(at, pulls + setup::lateral, lateral.x), put(at, pulls + setup::lateral + 1, lateral.y);
        for (std::size_t c = 0; c < setup.unknown.size(); ++c) chunk.pull(setup.unknown[c], part(at, pulls + int(c)));
    }
}

void evaluate_lanes(const SimdProblem& problem, const SimdModel::At& at, double* scratch) {
    const std::size_t width = hn::Lanes(Tag());
    double* const setups = scratch + problem.nodes.size() * node_parts * width;
    for (std::size_t lane = 0; lane < lane_group; lane += width) {
        Chunk chunk{problem, at, lane, scratch, setups, hn::Zero(Tag())};
        prepare_nodes(chunk);
        prepare_setups(chunk);
        for (const SimdProblem::Point& point : problem.points) pull_point(chunk, point);
        finish_nodes(chunk);
        finish_setups(chunk);
        double largest[widest_vector];
        hn::StoreU(chunk.largest_turn, Tag(), largest);
        for (std::size_t i = 0; i < width; ++i) at.is_valid[lane + i] = largest[i] <= largest_angle2;
    }
}

std::size_t scratch_numbers(const SimdProblem& problem) {
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

SimdProblem::SimdProblem(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input)
    : kind(HeadLayout::ideal),
      unknowns(problem.size()),
      channels(0),
      tool(problem.tool()),
      moves_axes(problem.moves_axes()),
      setup_size(0) {
    const auto place = [&](int unknown) { return unknown == no_unknown ? unknowns : unknown; };
    for (const LineSetup& setup : problem.setups()) {
        const ChannelModel& model = setup.model;
        kind = model.kind();
        channels = std::max(channels, model.channels());
        setup_size = std::max(setup_size, model.setup_size());
        Setup& to = setups.emplace_back(Setup{{}, model.machine_R_line(), model.origin(), &model.head()});
        for (const int unknown : setup.unknown) to.unknown.push_back(place(unknown));
    }
    for (const AxisNode& node : problem.nodes()) {
        Node& to = nodes.emplace_back();
        for (int c = 0; c < 6; ++c) to.unknown[c] = place(node.unknown[c]);
        to.position = {};
        to.position[index(node.axis)] = node.position;
    }
    nodes.push_back({{unknowns, unknowns, unknowns, unknowns, unknowns, unknowns}, {}});  // home
    const auto& order = problem.chain().order();
    for (int p = 0; p < 3; ++p) {
        carries_workpiece[p] = problem.chain().carries_workpiece(order[p]);
        axis[p] = index(order[p]);
    }
    for (const CoefficientUnknown& of : problem.coefficients())
        coefficients.push_back({of.unknown, of.axes, of.of_drift});
    for (const AdjustedPoint& point : problem.points()) {
        Point& to = points.emplace_back();
        to = {point.setup, {}, point.place.travel, point.place.time, point.place.drifted, int(of_points.size()),
              {},          {}};
        for (int a = 0; problem.expansion() && a < 3; ++a) {
            to.stretch[a] = point.place.stretch[a];
            to.expansion[a] = problem.expansion()->expansion.coefficient[a] * to.stretch[a];
        }
        for (int p = 0; p < 3; ++p) {
            const int node = point.node[index(order[p])];
            to.node[p] = node == no_unknown ? int(nodes.size()) - 1 : node;
        }
        of_points.resize(of_points.size() + channels, {no_reading, 0, 0.0});
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const AdjustedReading& reading = problem.readings()[r];
            of_points[to.first_channel + reading.channel] = {r, input[r], 1.0 / reading.standard_uncertainty};
        }
    }
}

SimdModel::SimdModel(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input)
    : problem_(problem, input), scratch_(std::ptrdiff_t(HWY_DYNAMIC_DISPATCH(scratch_numbers)(problem_))) {}

void SimdModel::evaluate(const At& at) {
    std::fill_n(at.pulled, lane_group * std::size_t(problem_.unknowns + 1), 0.0);
    HWY_DYNAMIC_DISPATCH(evaluate_lanes)(problem_, at, scratch_.data());
}

}  // namespace stepdiag
#endif  // HWY_ONCE
