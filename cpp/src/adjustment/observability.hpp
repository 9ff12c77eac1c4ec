// What a run's readings determine, decided at zero errors, and what they leave open. Internal: not installed.
// A sum of unknowns is determined where no null vector of the column-scaled problem changes it.
#pragma once

#include <vector>

#include "adjustment/adjustment_tables.hpp"
#include "adjustment/gauss_newton.hpp"

namespace stepdiag {

// A sum of undetermined unknowns that is determined all the same, still without its value.
struct OpenCombination {
    LinearForm form = {};
    KnownCombination combination = {};
};

// By unknown: the unit in which its column of the weighted problem, of this length, has length 1.
Eigen::VectorXd units_of_columns(const Eigen::VectorXd& lengths);
// Unknowns and forms that a null vector changes are not determined.
void mark_touched(const Eigen::VectorXd& null_vector, const Eigen::VectorXd& units,
                  const std::vector<LinearForm*>& forms, std::vector<bool>& determined);

class Observability {
public:
    // Marks the tables' forms.
    Observability(const GaussNewton& solver, AdjustmentTables& tables);

    const std::vector<bool>& determined() const { return determined_; }
    // `known`: by unknown; determined(), or less.
    std::vector<Undetermined> findings(const std::vector<bool>& known) const;
    const std::vector<OpenCombination>& combinations() const { return combinations_; }

private:
    void combine_slopes(const GaussNewton& solver);
    void add_functions(std::vector<Undetermined>& findings) const;
    Undetermined open_slope(FunctionId id) const;
    void add_reversal(std::vector<Undetermined>& findings) const;
    void add_setups(const std::vector<bool>& known, std::vector<Undetermined>& findings) const;

    const AdjustmentProblem& problem_;
    const AdjustmentTables& tables_;
    std::vector<bool> determined_;
    std::vector<OpenCombination> combinations_;
};

}  // namespace stepdiag
