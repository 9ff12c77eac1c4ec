// What the raw channels of a head read, as one differentiable function of the machine's errors at the axes' nodes and
// of the line's set-up: exact pose (machine/machine.hpp), exact readings (measurement/reading.hpp). Internal: not
// installed.
//   q = S^T (p - o), m = S^T n, S the sensor frame: beta = m_x/m_z, alpha = -m_y/m_z, L = q_z + beta q_x - alpha q_y
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/machine.hpp"
#include "stepdiag/measurement/head_calibration.hpp"
#include "stepdiag/measurement/setup_quantity.hpp"

namespace stepdiag {

// (delta_a, theta_a) of an axis at a node, squareness terms included: mm, rad.
using AxisErrors = Eigen::Matrix<double, 6, 1>;
using MachineErrors = std::array<AxisErrors, 3>;  // by axis

// Where and when a reading was made.
struct ReadingPlace {
    Eigen::Vector3d commanded;                             // mm
    double travel = 0.0;                                   // commanded, from the line's first point along it, mm
    double time = 0.0;                                     // since the set-up's first reading, s
    double drifted = 0.0;                                  // since the run's first, s or K (MachineDrift)
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();     // of the scales, by axis (Expansion::stretch), mm K
    Eigen::Vector3d from_fixed = Eigen::Vector3d::Zero();  // by axis, of the scales' fixed points, mm
};

// The pose with its derivatives by (delta_a, theta_a): a column of `shift` moves the functional point, one of `turn` is
// the rotation vector in the machine frame.
struct PoseDerivative {
    Pose pose;
    std::array<Eigen::Matrix3d, 3> shift;  // by delta_a
    std::array<Eigen::Matrix3d, 3> turn;   // by theta_a
    std::array<Eigen::Vector3d, 3> lever;  // of the functional point, to which theta_a turns it
};
// `derivatives` false: the pose only.
PoseDerivative differentiate_pose(const Chain& chain, const Eigen::Vector3d& tool, const Eigen::Vector3d& commanded,
                                  const MachineErrors& errors, bool derivatives = true);

// The derivative of the channels: 18 columns by the axes' errors, axis by axis, then those of the set-up.
using ChannelDerivative = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class ChannelModel {
public:
    // `origin`: of the beam on a well aligned line, o = P0 - standoff z, machine frame, mm.
    ChannelModel(HeadLayout kind, const HeadCalibration& head, const Eigen::Matrix3d& machine_R_line,
                 const Eigen::Vector3d& origin);

    int channels() const { return kind_ == HeadLayout::multi_beam ? int(head_->beam_offsets.size()) : 3; }
    int beams() const { return kind_ == HeadLayout::multi_beam ? channels() : 0; }
    int setup_size() const { return setup::size(beams()); }
    HeadLayout kind() const { return kind_; }
    const HeadCalibration& head() const { return *head_; }
    const Eigen::Matrix3d& machine_R_line() const { return line_; }
    const Eigen::Vector3d& origin() const { return origin_; }

    // The set-up of the readings that follow; `setup` has setup_size() entries.
    void set_up(const Eigen::Ref<const Eigen::VectorXd>& setup);
    // What the channels read. `derivative`: channels() x (18 + setup_size()), where it is asked for. The mirror must
    // face the head.
    void read(const PoseDerivative& pose, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
              ChannelDerivative* derivative) const;

private:
    struct Tilt;
    void read_channels(const Tilt& tilt, const ReadingPlace& place, Eigen::Ref<Eigen::VectorXd> reading,
                       ChannelDerivative* derivative) const;

    HeadLayout kind_;
    const HeadCalibration* head_;
    Eigen::Matrix3d line_;    // machine_R_line
    Eigen::Vector3d origin_;  // nominal

    Eigen::VectorXd setup_;
    Eigen::Matrix3d sensor_;       // machine_R_sensor
    Eigen::Vector3d beam_origin_;  // o
    Eigen::Vector3d normal_;       // of the mirror, in the tool's frame
    Eigen::Matrix<double, 3, 2> normal_by_reflector_;
    Eigen::Matrix3d sensor_turn_;  // rotation vectors in the sensor frame by laser a, laser b, roll
};

// How finely a reading is known at best: its numbers are rounded. A standard uncertainty below that means nothing.

// Standard uncertainty of a reading and of its model by double precision. Residuals of runs without noise have an rms
// of 0.6 times that of distances, for machines of 1 mm to 10 m (benchmarks/precision.py). `longest`: of the lengths
// that pose and reading are calculated from, mm.
double double_rounding(HeadLayout kind, int channel, double longest);

// Readings of one channel were written with so many decimals that they are all multiples of the step that this returns:
// 100, 10, ... 1e-9 units; 0 where they are finer. `unit`: of files, 1e-6 for µrad. Multiples where the plan has
// multiples, too, or all as far from the plan, tell none: a machine without errors reads round numbers.
double decimal_step(const std::vector<double>& values, const std::vector<double>& planned, double unit);

}  // namespace stepdiag
