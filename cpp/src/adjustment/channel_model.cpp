#include "adjustment/channel_model.hpp"

#include <Eigen/Geometry>

#include "stepdiag/core/rotation.hpp"

namespace stepdiag {

PoseDerivative differentiate_pose(const Chain& chain, const Eigen::Vector3d& tool, const Eigen::Vector3d& commanded,
                                  const MachineErrors& errors, bool derivatives) {
    PoseDerivative result;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    for (const Axis axis : chain.order()) {
        const int a = index(axis);
        const Eigen::Vector3d shift = commanded[a] * Eigen::Vector3d::Unit(a) + errors[a].head<3>();
        const Eigen::Vector3d theta = errors[a].tail<3>();
        if (derivatives) result.turn[a] = rotation * rotation_jacobian(theta);
        if (chain.carries_workpiece(axis)) {
            result.pivot[a] = position;
            rotation = rotation * rotation_exp(theta);
            result.shift[a] = rotation;
            position += rotation * shift;
        } else {
            result.shift[a] = rotation;
            position += rotation * shift;
            result.pivot[a] = position;
            rotation = rotation * rotation_exp(theta);
        }
    }
    result.pose.rotation = rotation;
    result.pose.position = position + rotation * tool;
    return result;
}

// Length and tilts of a reading, and their derivatives by everything: rows L, alpha, beta.
struct ChannelModel::Tilt {
    double length, alpha, beta;
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
    const Eigen::Vector3d reflector(values[setup::reflector], values[setup::reflector + 1], 0.0);
    const Eigen::Vector3d laser(values[setup::laser], values[setup::laser + 1], 0.0);
    const Eigen::Vector3d roll(0.0, 0.0, values[setup::roll]);
    const Eigen::Matrix3d rolled = rotation_exp(roll);

    const Eigen::Matrix3d mirror = line_ * rotation_exp(reflector);
    normal_ = mirror.col(2);
    // Exp(r + dr) = Exp(r) Exp(J^T dr), so that z turns by (J^T dr) x z in the mirror's own frame.
    const Eigen::Matrix3d own = rotation_jacobian(reflector).transpose();
    for (int i = 0; i < 2; ++i)
        normal_by_reflector_.col(i) = mirror * Eigen::Vector3d(own.col(i)).cross(Eigen::Vector3d::UnitZ());

    sensor_ = line_ * rotation_exp(laser) * rolled;
    sensor_turn_.leftCols<2>() = rolled.transpose() * rotation_jacobian(laser).transpose().leftCols<2>();
    sensor_turn_.col(2) = Eigen::Vector3d::UnitZ();
    beam_origin_ = origin_ + values[setup::lateral] * line_.col(0) + values[setup::lateral + 1] * line_.col(1);
}

void ChannelModel::read(const PoseDerivative& pose, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
                        ChannelDerivative* derivative) const {
    const Eigen::Vector3d normal = pose.pose.rotation * normal_;
    const Eigen::Vector3d q = sensor_.transpose() * (pose.pose.position - beam_origin_);
    const Eigen::Vector3d m = sensor_.transpose() * normal;
    Tilt tilt;
    tilt.beta = m.x() / m.z();
    tilt.alpha = -m.y() / m.z();
    tilt.length = q.z() + tilt.beta * q.x() - tilt.alpha * q.y();
    if (derivative) {
        // Gradients by q and m in the sensor frame, then as vectors of the machine frame.
        const Eigen::Vector3d beta_by_m = Eigen::Vector3d(1.0, 0.0, -tilt.beta) / m.z();
        const Eigen::Vector3d alpha_by_m = -Eigen::Vector3d(0.0, 1.0, tilt.alpha) / m.z();
        const Eigen::Vector3d length_by_q(tilt.beta, -tilt.alpha, 1.0);
        const Eigen::Vector3d length_by_m = q.x() * beta_by_m - q.y() * alpha_by_m;
        const Eigen::Vector3d length_by_point = sensor_ * length_by_q;
        const Eigen::Vector3d length_by_normal = sensor_ * length_by_m;
        const Eigen::Vector3d alpha_by_normal = sensor_ * alpha_by_m, beta_by_normal = sensor_ * beta_by_m;

        const Eigen::Vector3d turned_length = normal.cross(length_by_normal);
        const Eigen::Vector3d turned_alpha = normal.cross(alpha_by_normal), turned_beta = normal.cross(beta_by_normal);
        for (int a = 0; a < 3; ++a) {
            const Eigen::Vector3d lever = pose.pose.position - pose.pivot[a];
            tilt.by_axes.block<1, 3>(0, 6 * a) = length_by_point.transpose() * pose.shift[a];
            tilt.by_axes.block<2, 3>(1, 6 * a).setZero();
            tilt.by_axes.block<1, 3>(0, 6 * a + 3) =
                (lever.cross(length_by_point) + turned_length).transpose() * pose.turn[a];
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

// From length and tilts to the channels (measurement/reading.hpp), with what the set-up adds to them.
void ChannelModel::read_channels(const Tilt& tilt, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
                                 ChannelDerivative* derivative) const {
    const double w = 1.0 - tilt.alpha * tilt.alpha - tilt.beta * tilt.beta;
    const double scale = 1.0 + setup_[setup::gain];
    const double constant = setup_[setup::distance_constant] + setup_[setup::drift] * place.time +
                            setup_[setup::scale_factor] * place.travel;
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
        const double at = tilt.length - scale * (tilt.beta * offset.x() - tilt.alpha * offset.y());
        put(channel, at / w + constant,
            Eigen::RowVector3d(1.0, scale * offset.y() + 2.0 * tilt.alpha * at / w,
                               -scale * offset.x() + 2.0 * tilt.beta * at / w) /
                w);
        if (!derivative) return;
        auto row = derivative->row(channel);
        row[18 + setup::distance_constant] = 1.0;
        row[18 + setup::drift] = place.time;
        row[18 + setup::scale_factor] = place.travel;
        row[18 + setup::gain] = (tilt.alpha * offset.y() - tilt.beta * offset.x()) / w;
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
        put(1, scale * tilt.alpha, {0.0, scale, 0.0});
        put(2, scale * tilt.beta, {0.0, 0.0, scale});
        if (derivative) {
            (*derivative)(1, 18 + setup::gain) = tilt.alpha;
            (*derivative)(2, 18 + setup::gain) = tilt.beta;
        }
        return;
    }
    const Eigen::Vector2d& beam = head_->spot_beam;
    const double beyond = tilt.length - tilt.beta * beam.x() + tilt.alpha * beam.y() + *head_->psd_distance;
    const double lever = 2.0 * beyond / w;
    const Eigen::RowVector3d lever_gradient =
        2.0 / w *
        Eigen::RowVector3d(1.0, beam.y() + 2.0 * tilt.alpha * beyond / w, -beam.x() + 2.0 * tilt.beta * beyond / w);
    const Eigen::Vector2d spot(-lever * tilt.beta, lever * tilt.alpha);
    put(1, scale * spot.x() + setup_[setup::psd_zero],
        scale * (-tilt.beta * lever_gradient - Eigen::RowVector3d(0.0, 0.0, lever)));
    put(2, scale * spot.y() + setup_[setup::psd_zero + 1],
        scale * (tilt.alpha * lever_gradient + Eigen::RowVector3d(0.0, lever, 0.0)));
    if (!derivative) return;
    for (int i = 0; i < 2; ++i) {
        (*derivative)(1 + i, 18 + setup::psd_zero + i) = 1.0;
        (*derivative)(1 + i, 18 + setup::gain) = spot[i];
    }
}

}  // namespace stepdiag
