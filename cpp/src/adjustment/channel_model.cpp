#include "adjustment/channel_model.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "machine/pose-inl.hpp"
#include "measurement/reading-inl.hpp"

namespace stepdiag {

using namespace STEPDIAG_NAMESPACE;

PoseDerivative differentiate_pose(const Chain& chain, const Eigen::Vector3d& tool, const Eigen::Vector3d& commanded,
                                  const MachineErrors& errors, bool derivatives) {
    const auto motion = [&](int rank) -> AxisMotion<double> {
        const int a = index(chain.order()[rank]);
        const Eigen::Vector3d shift = commanded[a] * Eigen::Vector3d::Unit(a) + errors[a].head<3>();
        return {rotation_exp(broadcast3<double>(errors[a].data() + 3)), broadcast3<double>(shift),
                chain.carries_workpiece(chain.order()[rank])};
    };
    const AxisMotion<double> motions[] = {motion(0), motion(1), motion(2)};
    const ChainPose<double> pose = chain_pose(motions, broadcast3<double>(tool));
    PoseDerivative result;
    result.pose = {to_eigen(pose.rotation), to_eigen(pose.position)};
    if (!derivatives) return result;
    Eigen::Matrix3d before = Eigen::Matrix3d::Identity();
    for (int rank = 0; rank < 3; ++rank) {
        const int a = index(chain.order()[rank]);
        const Eigen::Matrix3d after = before * to_eigen(motions[rank].rotation);
        result.shift[a] = motions[rank].carries_workpiece ? after : before;
        result.turn[a] = before * to_eigen(rotation_jacobian(broadcast3<double>(errors[a].data() + 3)));
        result.lever[a] = before * to_eigen(pose.arm[rank]);
        before = after;
    }
    return result;
}

// A reading, and the derivatives of its length and tilts by everything: rows L, alpha, beta.
struct ChannelModel::Tilt {
    MirrorReading<double> mirror;
    Eigen::Matrix<double, 3, 18> by_axes;
    Eigen::Matrix<double, 3, 8> by_setup;  // reflector, laser, lateral, roll: 2, 2, 2, 1; the last column is not used
};

ChannelModel::ChannelModel(HeadLayout kind, const HeadCalibration& head, const Eigen::Matrix3d& machine_R_line,
                           const Eigen::Vector3d& origin)
    : kind_(kind), head_(&head), line_(machine_R_line), origin_(origin) {
    set_up(Eigen::VectorXd::Zero(setup_size()));
}

void ChannelModel::set_up(const Eigen::Ref<const Eigen::VectorXd>& values) {
    setup_ = values;
    const auto pair = [&](int column) { return Vector3<double>{values[column], values[column + 1], 0.0}; };
    const Placing<double> placing{
        pair(setup::reflector), pair(setup::laser), {0.0, 0.0, values[setup::roll]}, pair(setup::lateral)};
    const Placed<double> placed = place_setup(broadcast9<double>(line_), broadcast3<double>(origin_), placing);
    sensor_ = to_eigen(placed.machine_R_sensor);
    beam_origin_ = to_eigen(placed.origin);

    const Eigen::Matrix3d mirror = to_eigen(placed.tool_R_mirror);
    normal_ = mirror.col(2);
    // Exp(r + dr) = Exp(r) Exp(J^T dr), so that z turns by (J^T dr) x z in the mirror's own frame.
    const Eigen::Matrix3d own = to_eigen(rotation_jacobian(placing.reflector)).transpose();
    for (int i = 0; i < 2; ++i)
        normal_by_reflector_.col(i) = mirror * Eigen::Vector3d(own.col(i)).cross(Eigen::Vector3d::UnitZ());
    const Eigen::Matrix3d rolled = to_eigen(rotation_exp(placing.roll));
    sensor_turn_.leftCols<2>() =
        rolled.transpose() * to_eigen(rotation_jacobian(placing.laser)).transpose().leftCols<2>();
    sensor_turn_.col(2) = Eigen::Vector3d::UnitZ();
}

void ChannelModel::read(const PoseDerivative& pose, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
                        ChannelDerivative* derivative) const {
    const Eigen::Vector3d normal = pose.pose.rotation * normal_;
    const Eigen::Vector3d q = sensor_.transpose() * (pose.pose.position - beam_origin_);
    const Eigen::Vector3d m = sensor_.transpose() * normal;
    const double inverse_z = 1.0 / m.z();
    Tilt tilt;
    const MirrorReading<double>& mirror = tilt.mirror =
        read_plane(broadcast3<double>(q), broadcast3<double>(m), inverse_z);
    if (derivative) {
        // Gradients by q and m in the sensor frame, then as vectors of the machine frame.
        const Eigen::Vector3d beta_by_m = Eigen::Vector3d(1.0, 0.0, -mirror.beta) * inverse_z;
        const Eigen::Vector3d alpha_by_m = -Eigen::Vector3d(0.0, 1.0, mirror.alpha) * inverse_z;
        const Eigen::Vector3d length_by_q(mirror.beta, -mirror.alpha, 1.0);
        const Eigen::Vector3d length_by_m = q.x() * beta_by_m - q.y() * alpha_by_m;
        const Eigen::Vector3d length_by_point = sensor_ * length_by_q;
        const Eigen::Vector3d length_by_normal = sensor_ * length_by_m;
        const Eigen::Vector3d alpha_by_normal = sensor_ * alpha_by_m, beta_by_normal = sensor_ * beta_by_m;

        const Eigen::Vector3d turned_length = normal.cross(length_by_normal);
        const Eigen::Vector3d turned_alpha = normal.cross(alpha_by_normal), turned_beta = normal.cross(beta_by_normal);
        for (int a = 0; a < 3; ++a) {
            tilt.by_axes.block<1, 3>(0, 6 * a) = length_by_point.transpose() * pose.shift[a];
            tilt.by_axes.block<2, 3>(1, 6 * a).setZero();
            tilt.by_axes.block<1, 3>(0, 6 * a + 3) =
                (pose.lever[a].cross(length_by_point) + turned_length).transpose() * pose.turn[a];
            tilt.by_axes.block<1, 3>(1, 6 * a + 3) = turned_alpha.transpose() * pose.turn[a];
            tilt.by_axes.block<1, 3>(2, 6 * a + 3) = turned_beta.transpose() * pose.turn[a];
        }

        const Eigen::Matrix<double, 3, 2> normal_by_reflector = pose.pose.rotation * normal_by_reflector_;
        Eigen::Matrix3d by_normal;
        by_normal << length_by_normal.transpose(), alpha_by_normal.transpose(), beta_by_normal.transpose();
        tilt.by_setup.leftCols<2>() = by_normal * normal_by_reflector;
        // The sensor turned by w sees everything turned by -w.
        Eigen::Matrix3d by_turn;
        by_turn << -(q.cross(length_by_q) + m.cross(length_by_m)).transpose(), -m.cross(alpha_by_m).transpose(),
            -m.cross(beta_by_m).transpose();
        const Eigen::Matrix3d by_sensor = by_turn * sensor_turn_;
        tilt.by_setup.middleCols<2>(2) = by_sensor.leftCols<2>();
        tilt.by_setup.middleCols<2>(4).setZero();
        tilt.by_setup.block<1, 2>(0, 4) = -length_by_point.transpose() * line_.leftCols<2>();
        tilt.by_setup.col(6) = by_sensor.col(2);
    }
    read_channels(tilt, place, reading, derivative);
}

// From length and tilts to the channels, with what the set-up adds to them.
void ChannelModel::read_channels(const Tilt& tilt, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
                                 ChannelDerivative* derivative) const {
    const MirrorReading<double>& mirror = tilt.mirror;
    const double scale = 1.0 + setup_[setup::gain];
    const double added = distance_added(setup_[setup::distance_constant], setup_[setup::drift], place.time,
                                        setup_[setup::scale_factor], place.travel);
    if (derivative) derivative->setZero();
    // The channel's value, and its gradient by (L, alpha, beta).
    const auto put = [&](int channel, double value, const Eigen::RowVector3d& gradient) {
        reading[channel] = value;
        if (!derivative) return;
        auto row = derivative->row(channel);
        row.head<18>() = gradient * tilt.by_axes;
        const Eigen::Matrix<double, 1, 8> by_setup = gradient * tilt.by_setup;
        row.segment<4>(18 + setup::reflector) = by_setup.head<4>();
        row.segment<2>(18 + setup::lateral) = by_setup.segment<2>(4);
        row[18 + setup::roll] = by_setup[6];
    };
    const auto put_distance = [&](int channel, const Eigen::Vector2d& offset) {
        const double arm = beam_arm(mirror, offset.x(), offset.y());
        const double distance = beam_distance(mirror, scale * arm), twice = 2.0 * distance;
        put(channel, distance + added,
            Eigen::RowVector3d(1.0, scale * offset.y() + twice * mirror.alpha,
                               -scale * offset.x() + twice * mirror.beta) *
                mirror.inverse_w);
        if (!derivative) return;
        auto row = derivative->row(channel);
        row[18 + setup::distance_constant] = 1.0;
        row[18 + setup::drift] = place.time;
        row[18 + setup::scale_factor] = place.travel;
        row[18 + setup::gain] = arm * mirror.inverse_w;
    };

    if (kind_ == HeadLayout::multi_beam) {
        for (int i = 0; i < channels(); ++i) {
            put_distance(i, head_->beam_offsets[i]);
            reading[i] += setup_[setup::beam_constants + i];
            if (derivative) (*derivative)(i, 18 + setup::beam_constants + i) = 1.0;
        }
        return;
    }
    put_distance(0, Eigen::Vector2d::Zero());
    if (kind_ == HeadLayout::ideal) {
        put(1, scale * mirror.alpha, {0.0, scale, 0.0});
        put(2, scale * mirror.beta, {0.0, 0.0, scale});
        if (derivative) {
            (*derivative)(1, 18 + setup::gain) = mirror.alpha;
            (*derivative)(2, 18 + setup::gain) = mirror.beta;
        }
        return;
    }
    const Eigen::Vector2d& beam = head_->spot_beam;
    const double lever = spot_lever(mirror, beam_arm(mirror, beam.x(), beam.y()), *head_->psd_distance);
    const Eigen::RowVector3d lever_gradient =
        2.0 * mirror.inverse_w *
        Eigen::RowVector3d(1.0, beam.y() + mirror.alpha * lever, -beam.x() + mirror.beta * lever);
    const auto spot = spot_reading(mirror, scale * lever, setup_[setup::psd_zero], setup_[setup::psd_zero + 1]);
    put(1, spot.x, scale * (-mirror.beta * lever_gradient - Eigen::RowVector3d(0.0, 0.0, lever)));
    put(2, spot.y, scale * (mirror.alpha * lever_gradient + Eigen::RowVector3d(0.0, lever, 0.0)));
    if (!derivative) return;
    for (int i = 0; i < 2; ++i) (*derivative)(1 + i, 18 + setup::psd_zero + i) = 1.0;
    (*derivative)(1, 18 + setup::gain) = -lever * mirror.beta;
    (*derivative)(2, 18 + setup::gain) = lever * mirror.alpha;
}

namespace {
constexpr double epsilon = std::numeric_limits<double>::epsilon();
}

double double_rounding(HeadLayout kind, int channel, double longest) {
    constexpr double of_tilt = 8.0 * epsilon;  // components of unit vectors, multiplied through the chain
    if (kind == HeadLayout::multi_beam || channel == 0) return epsilon * longest;
    return kind == HeadLayout::psd ? 2.0 * of_tilt * longest : of_tilt;  // a spot moves by the double path
}

double decimal_step(const std::vector<double>& values, const std::vector<double>& planned, double unit) {
    constexpr int coarsest = -2, most_decimals = 9;  // of decimals: from hundreds of units
    constexpr double unclear = 1e-3;                 // of a step: as much may be rounding
    constexpr std::size_t enough = 5;                // places beside the plan; fewer may be chance
    constexpr double told = 100.0;                   // places a step: the plan has lengths between the multiples
    double size = 0.0;
    for (const double value : values) size = std::max(size, std::abs(value));
    double per_unit = std::pow(10.0, coarsest) / unit;
    for (int decimals = coarsest; decimals <= most_decimals; ++decimals, per_unit *= 10.0) {
        if (4.0 * epsilon * size * per_unit > unclear) return 0.0;
        const bool is_multiple = std::all_of(values.begin(), values.end(), [&](double value) {
            return std::abs(value * per_unit - std::round(value * per_unit)) <= unclear;
        });
        if (!is_multiple) continue;
        std::set<double> beside;
        for (std::size_t i = 0; i < values.size() && beside.size() < enough; ++i)
            beside.insert(std::round((values[i] - planned[i]) * per_unit * told));
        return beside.size() < enough ? 0.0 : 1.0 / per_unit;
    }
    return 0.0;
}

}  // namespace stepdiag
