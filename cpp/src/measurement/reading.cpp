#include "stepdiag/measurement/reading.hpp"

#include <Eigen/LU>
#include <cmath>

namespace stepdiag {

std::optional<Reading> read_mirror(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    if (!(normal.z() > 0.0)) return std::nullopt;
    Reading reading{0.0, -normal.y() / normal.z(), normal.x() / normal.z()};
    const double length = point.z() + reading.beta * point.x() - reading.alpha * point.y();
    if (!(reading.tan2_phi() < 1.0) || !(length > 0.0)) return std::nullopt;
    reading.distance = length / (1.0 - reading.tan2_phi());
    return reading;
}

Eigen::VectorXd beam_distances(const Reading& reading, const std::vector<Eigen::Vector2d>& beam_offsets) {
    Eigen::VectorXd distances(beam_offsets.size());
    for (std::size_t i = 0; i < beam_offsets.size(); ++i)
        distances[i] = reading.distance + (reading.alpha * beam_offsets[i].y() - reading.beta * beam_offsets[i].x()) /
                                              (1.0 - reading.tan2_phi());
    return distances;
}

Eigen::Vector2d spot_position(const Reading& reading, double psd_distance) {
    const double scale = 2.0 * (reading.distance + psd_distance / (1.0 - reading.tan2_phi()));
    return scale * Eigen::Vector2d(-reading.beta, reading.alpha);
}

std::optional<ReducedReading> reduce_spot(double distance, const Eigen::Vector2d& spot, double psd_distance) {
    // |spot| = s is 2 tau (distance + psd_distance/(1 - tau^2)) with tau = tan(phi): solved for tau by Newton's method.
    const double s = spot.norm();
    if (!(distance > 0.0) || !(distance + psd_distance > 0.0)) return std::nullopt;
    double tau = s / (2.0 * (distance + psd_distance));
    double slope = 0.0;  // d s / d tau
    for (int iteration = 0; iteration < 20; ++iteration) {
        if (!(tau < 1.0)) return std::nullopt;
        const double w = 1.0 - tau * tau;
        slope = 2.0 * distance + 2.0 * psd_distance * (1.0 + tau * tau) / (w * w);
        if (!(slope > 0.0)) return std::nullopt;
        const double change = (s - 2.0 * tau * (distance + psd_distance / w)) / slope;
        tau += change;
        if (std::abs(change) <= 1e-17 + 1e-16 * tau) break;
    }
    if (!(tau < 1.0)) return std::nullopt;

    // (-beta, alpha) = spot / gain with gain = s/tau; gain and its derivatives stay finite as s -> 0.
    const double w = 1.0 - tau * tau;
    const double gain = 2.0 * (distance + psd_distance / w);
    ReducedReading reduced{{distance, spot.y() / gain, -spot.x() / gain}, Eigen::Matrix3d::Zero()};
    const double gain_by_tau = 4.0 * psd_distance * tau / (w * w);
    const double tau_by_distance = -2.0 * tau / slope;
    const double gain_by_distance = 2.0 + gain_by_tau * tau_by_distance;
    const Eigen::Vector2d gain_by_spot =
        s > 0.0 ? Eigen::Vector2d(gain_by_tau / slope * spot / s) : Eigen::Vector2d::Zero();
    const Eigen::Vector2d tilt = spot / gain;  // (-beta, alpha)
    Eigen::Matrix<double, 2, 3> by_channel;    // of tilt, by (distance, spot)
    by_channel.col(0) = -tilt / gain * gain_by_distance;
    by_channel.rightCols<2>() = Eigen::Matrix2d::Identity() / gain - tilt / gain * gain_by_spot.transpose();
    reduced.jacobian(0, 0) = 1.0;
    reduced.jacobian.row(1) = by_channel.row(1);
    reduced.jacobian.row(2) = -by_channel.row(0);
    return reduced;
}

std::optional<ReducedReading> reduce_beams(const Eigen::VectorXd& distances,
                                           const std::vector<Eigen::Vector2d>& beam_offsets) {
    // d_i = distance - b u_i + a v_i is linear in (distance, a, b), where alpha = a (1 - t) and beta = b (1 - t).
    const Eigen::Index n = distances.size();
    Eigen::Matrix<double, Eigen::Dynamic, 3> design(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) design.row(i) << 1.0, beam_offsets[i].y(), -beam_offsets[i].x();
    const Eigen::Matrix3d normal = design.transpose() * design;
    const double spread = design.rightCols<2>().squaredNorm();
    if (n < 3 || !(normal.determinant() > 1e-12 * n * spread * spread)) return std::nullopt;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> inverse = normal.inverse() * design.transpose();
    const Eigen::Vector3d solution = inverse * distances;

    // 1 - w = (a^2 + b^2) w^2 for w = 1 - t.
    const double m = solution.tail<2>().squaredNorm();
    const double root = std::sqrt(1.0 + 4.0 * m);
    const double w = 2.0 / (1.0 + root);
    const double w_by_m = -w * w / root;
    ReducedReading reduced{{solution[0], w * solution[1], w * solution[2]}, inverse};
    const Eigen::Matrix2d tilt_by_slope =
        w * Eigen::Matrix2d::Identity() + 2.0 * w_by_m * solution.tail<2>() * solution.tail<2>().transpose();
    reduced.jacobian.bottomRows<2>() = tilt_by_slope * inverse.bottomRows<2>();
    return reduced;
}

}  // namespace stepdiag
