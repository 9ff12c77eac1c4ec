// What readings tell of the changes of a machine, everything else being estimated with them. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stepdiag/recheck/recheck.hpp"

namespace stepdiag {

// Along directions of the changes, each by its prior, whose estimates are independent.
struct ToldChanges {
    Eigen::VectorXd information;  // of each direction, ascending: 1 is as much as the priors tell
    Eigen::MatrixXd direction;    // a column each
    Eigen::Index first;           // from here on readings tell more than the priors

    // `information`: of the changes by their priors.
    explicit ToldChanges(const Eigen::MatrixXd& information);

    // Those that are told better than by the priors, the best first. `estimate`: by direction.
    std::vector<ChangeCombination> combinations(const Eigen::VectorXd& estimate) const;
};

Eigen::VectorXd priors_of(const std::vector<ChangeTerm>& terms);

// As smallest_changes_seen(). `prior`: by term.
Eigen::VectorXd smallest_changes(const std::vector<ChangeCombination>& told, const Eigen::VectorXd& prior, double alpha,
                                 double power);

}  // namespace stepdiag
