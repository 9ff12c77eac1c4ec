// The enhanced evaluation of Dahlem, Montavon, Peterek and Schmitt (2018), over all lines given.
//  1. Angles: the tilts' increments over a step of axis a are the first two components of machine_R_line^T times the
//     increment of theta_a; all lines stacked (eq. 4), solved by weighted pseudoinverse (eq. 5), summed from home.
//  2. Lengths: each distance becomes the beam's length L = q_z + beta q_x - alpha q_y, exact in the sensor frame with
//     q the vector from beam origin to functional point. Taken off are the commanded travel, the lever arm times the
//     tilts (its lateral part, "effective lever arm"), and the angular contribution n . sum_a theta_a x L_a.
//  3. Trends: what is left of a step is n_d . (delta_a(i+1) - delta_a(i)) plus, to first order, the lateral travel
//  times
//     the unknown laser angles of the line. Sums over an axis' travel and the scale lines make the slope system for
//     scales, squarenesses and laser angles; its rank says which are determined.
//  4. Steps: corrected for the laser angles, solved by pseudoinverse, summed; straightness slopes are the frame choice.
// Lost readings are bridged: the change over lost points is the sum of the steps between, solved jointly where the
// steps that were read do not suffice. Covariance by eq. 6 from the raw channels, so that neighbouring increments share
// a reading. Left are second-order terms: nanometres, but tenths of a micrometre to micrometres at 1 mrad of laser
// misalignment.
#pragma once

#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

// Throws InvalidArgument for readings that do not belong to the plan, where nothing at all can be determined, or for a
// result that is not plausible. The verdict of the fit is what its contradictions say: eight
// tilts of a step for three rotations, four lengths for three translations, 15 trends for 14 slopes and laser angles.
Calibration evaluate_enhanced(const Measurement& measurement, const Plan& plan, const Chain& chain,
                              const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                              const EvaluationOptions& options = {});

}  // namespace stepdiag
