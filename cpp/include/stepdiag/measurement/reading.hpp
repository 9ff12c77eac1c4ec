// The exact definition of every reading, and its exact inverse (CONVENTIONS, "The head and what it reads").
// All vectors are in the sensor frame: beam along +z from the origin o, reference plane z = 0. With the mirror's normal
// (beta, -alpha, 1)/sqrt(1 + t), t = alpha^2 + beta^2 = tan^2(phi), and a point q of the mirror plane:
//   L        = q_z + beta q_x - alpha q_y                     length of the outgoing beam
//   distance = (L + L/cos 2 phi)/2 = L/(1 - t)                half the round trip between reference plane and mirror
//   d_i      = (L - beta u_i + alpha v_i)/(1 - t)             the same for a beam from (u_i, v_i)
//   spot     = 2 (L_s + psd_distance)/(1 - t) (-beta, alpha)  on the unfolded plane of the position sensing device,
//              from the place of a centred spot; L_s = L - beta u + alpha v for a beam from (u, v)
// These follow from n/(n.d) = (beta, -alpha, 1) and r = d - 2(n.d)n without approximation.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/measurement/head_calibration.hpp"

namespace stepdiag {

// Distance (mm) and tilts (rad): the ideal head's reading, to which the others are reduced.
struct Reading {
    double distance;
    double alpha;
    double beta;

    double tan2_phi() const { return alpha * alpha + beta * beta; }
    double beam_length() const { return distance * (1.0 - tan2_phi()); }  // L
};

// The reading of a mirror plane through `point` with unit normal `normal` (pointing away from the head), both in the
// sensor frame. None where the reflected beam cannot come back (phi of 45 degrees or more) or the mirror is behind.
std::optional<Reading> read_mirror(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

Eigen::VectorXd beam_distances(const Reading& reading, const std::vector<Eigen::Vector2d>& beam_offsets);
Eigen::Vector2d spot_position(const Reading& reading, double psd_distance,
                              const Eigen::Vector2d& spot_beam = Eigen::Vector2d::Zero());

// A reading reduced from raw channels, with the derivatives of (distance, alpha, beta) by those channels.
struct ReducedReading {
    Reading reading;
    Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian;
};

// From distance and spot: channels (distance, spot_x, spot_y). None where no mirror gives that spot.
std::optional<ReducedReading> reduce_spot(double distance, const Eigen::Vector2d& spot, double psd_distance,
                                          const Eigen::Vector2d& spot_beam = Eigen::Vector2d::Zero());
// From beams d_i at (u_i, v_i), least squares where there are more than three: channels (d_1 ... d_n). None where the
// beams stand on one line, so that a tilt is not determined.
std::optional<ReducedReading> reduce_beams(const Eigen::VectorXd& distances,
                                           const std::vector<Eigen::Vector2d>& beam_offsets);

}  // namespace stepdiag
