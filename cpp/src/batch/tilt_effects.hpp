// How the derivatives of readings by a set-up's unknowns change with the tilt of the mirror to the beam. To first
// order, a roll and a gain change the readings of a tilted mirror as a laser's angles do, and a lateral offset changes
// them as a distance constant does. On a mirror that is not tilted these three change nothing, so that only their
// priors limit them: derivatives of other set-ups miss their effect entirely. Hence
//   J(x) = J0 T(x) approximately,   T = I + sum of factor (tilt(x) - tilt(start)) e_like e_of^T.
// Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_problem.hpp"

namespace stepdiag {

// Numbers of lanes are stored as in simd_model.hpp.
class TiltEffects {
public:
    // `start`: the unknowns at which J0 was computed.
    TiltEffects(const AdjustmentProblem& problem, const Eigen::VectorXd& start);

    void divide_transposed(const double* x, double* forces) const;  // forces := T(x)^-T forces
    void divide(const double* x, double* step) const;               // step := T(x)^-1 step

private:
    struct Effect {
        int of, like;     // unknowns
        int plus, minus;  // unknowns whose difference is the tilt
        double factor, tilt_at_start;
    };
    // What `of` does, in terms of `like`, in each lane.
    void find_shares(const Effect& effect, const double* x, double* share) const;

    std::vector<Effect> effects_;
};

}  // namespace stepdiag
