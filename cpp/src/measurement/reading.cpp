#include "stepdiag/measurement/reading.hpp"

#include <Eigen/LU>
#include <cmath>

#include "measurement/reading-inl.hpp"

namespace stepdiag {

using namespace STEPDIAG_NAMESPACE;

namespace {

MirrorReading<double> of_mirror(const Reading& reading) {
    const double w = 1.0 - reading.tan2_phi();
    return {reading.distance * w, reading.distance, reading.alpha, reading.beta, w, 1.0 / w};
}

// The spot's gain g(x), spot = g x with x = (-beta, alpha), and its gradient; its derivative by distance is 2.
struct SpotGain {
    double value;
    Eigen::Vector2d gradient;
};

SpotGain spot_gain(const Reading& reading, double psd_distance, const Eigen::Vector2d& spot_beam) {
    const MirrorReading<double> mirror = of_mirror(reading);
    const double arm = beam_arm(mirror, spot_beam.x(), spot_beam.y());
    const double beyond = (psd_distance + arm) * mirror.inverse_w;
    return {spot_lever(mirror, arm, psd_distance),
            2.0 * mirror.inverse_w * (spot_beam + 2.0 * beyond * Eigen::Vector2d(-reading.beta, reading.alpha))};
}

}  // namespace

std::optional<Reading> read_mirror(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    if (!(normal.z() > 0.0)) return std::nullopt;
    const auto reading = read_plane(broadcast3<double>(point), broadcast3<double>(normal), 1.0 / normal.z());
    if (!(reading.w > 0.0) || !(reading.length > 0.0)) return std::nullopt;
    return Reading{reading.distance, reading.alpha, reading.beta};
}

Eigen::VectorXd beam_distances(const Reading& reading, const std::vector<Eigen::Vector2d>& beam_offsets) {
    const MirrorReading<double> mirror = of_mirror(reading);
    Eigen::VectorXd distances(beam_offsets.size());
    for (std::size_t i = 0; i < beam_offsets.size(); ++i)
        distances[i] = beam_distance(mirror, beam_arm(mirror, beam_offsets[i].x(), beam_offsets[i].y()));
    return distances;
}

Eigen::Vector2d spot_position(const Reading& reading, double psd_distance, const Eigen::Vector2d& spot_beam) {
    return spot_gain(reading, psd_distance, spot_beam).value * Eigen::Vector2d(-reading.beta, reading.alpha);
}

std::optional<ReducedReading> reduce_spot(double distance, const Eigen::Vector2d& spot, double psd_distance,
                                          const Eigen::Vector2d& spot_beam) {
    if (!(distance > 0.0) || !(distance + psd_distance > 0.0)) return std::nullopt;
    // Newton's method for g(x) x = spot.
    Eigen::Vector2d x = spot / (2.0 * (distance + psd_distance));
    Eigen::Matrix2d inverse;  // d x / d spot
    for (int iteration = 0; iteration < 20; ++iteration) {
        if (!(x.squaredNorm() < 1.0)) return std::nullopt;
        const SpotGain gain = spot_gain({distance, x.y(), -x.x()}, psd_distance, spot_beam);
        const Eigen::Matrix2d slopes = gain.value * Eigen::Matrix2d::Identity() + x * gain.gradient.transpose();
        if (!(gain.value > 0.0) || !(slopes.determinant() > 0.0)) return std::nullopt;
        inverse = slopes.inverse();
        const Eigen::Vector2d change = inverse * (spot - gain.value * x);
        x += change;
        if (change.norm() <= 1e-17 + 1e-16 * x.norm()) break;
    }
    if (!(x.squaredNorm() < 1.0)) return std::nullopt;

    ReducedReading reduced{{distance, x.y(), -x.x()}, Eigen::Matrix3d::Zero()};
    Eigen::Matrix<double, 2, 3> by_channel;  // derivative of x with respect to (distance, spot)
    by_channel << -2.0 * inverse * x, inverse;
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
