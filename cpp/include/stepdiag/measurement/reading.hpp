// Exact definition of every reading, and its exact inverse (CONVENTIONS, "The head and what it reads"). All vectors are
// in the sensor frame: beam along +z from the origin o, reference plane z = 0. Lengths in mm, angles in rad. The mirror
// has the normal (beta, -alpha, 1)/sqrt(1 + t) with t = alpha^2 + beta^2 = tan^2(phi); q is a point of its plane:
//   L        = q_z + beta q_x - alpha q_y                     length of the outgoing beam
//   distance = (L + L/cos 2 phi)/2 = L/(1 - t)                half the round trip between reference plane and mirror
//   d_i      = (L - beta u_i + alpha v_i)/(1 - t)             the same for a beam that starts at (u_i, v_i)
//   spot     = 2 (L_s + psd_distance)/(1 - t) (-beta, alpha)  on the unfolded plane of the position sensing device,
//              relative to a centred spot; L_s = L - beta u + alpha v for a beam that starts at (u, v)
// The equations follow without approximation from n/(n.d) = (beta, -alpha, 1) and r = d - 2(n.d)n.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/measurement/head_calibration.hpp"

namespace stepdiag {

// Distance (mm) and tilts (rad): the reading of the ideal head. The readings of other heads are reduced to it.
struct Reading {
    double distance;
    double alpha;
    double beta;

    double tan2_phi() const { return alpha * alpha + beta * beta; }
    double beam_length() const { return distance * (1.0 - tan2_phi()); }  // L
};

// Reading of a mirror plane through `point` with the unit normal `normal`, which points away from the head. Empty if
// the reflected beam cannot return (phi of 45 degrees or more) or if the mirror is behind the reference plane.
std::optional<Reading> read_mirror(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

Eigen::VectorXd beam_distances(const Reading& reading, const std::vector<Eigen::Vector2d>& beam_offsets);
Eigen::Vector2d spot_position(const Reading& reading, double psd_distance,
                              const Eigen::Vector2d& spot_beam = Eigen::Vector2d::Zero());

// A reading reduced from raw channels, and the derivatives of (distance, alpha, beta) with respect to these channels.
struct ReducedReading {
    Reading reading;
    Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian;
};

// Reduces distance and spot; channels (distance, spot_x, spot_y). Empty if no mirror plane gives this spot.
std::optional<ReducedReading> reduce_spot(double distance, const Eigen::Vector2d& spot, double psd_distance,
                                          const Eigen::Vector2d& spot_beam = Eigen::Vector2d::Zero());
// Reduces the distances d_i of beams at (u_i, v_i), by least squares for more than three beams; channels (d_1 ... d_n).
// Empty if the beams are collinear, because they do not determine a tilt.
std::optional<ReducedReading> reduce_beams(const Eigen::VectorXd& distances,
                                           const std::vector<Eigen::Vector2d>& beam_offsets);

}  // namespace stepdiag
