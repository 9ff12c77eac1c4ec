// What a run's readings determine, decided at zero errors, and what they leave open in words. Internal: not installed.
// A sum of unknowns is determined where no null vector of the column-scaled problem changes it.
#pragma once

#include <string>
#include <vector>

#include "adjustment/adjustment_tables.hpp"
#include "adjustment/gauss_newton.hpp"

namespace stepdiag {

// A sum of undetermined unknowns that is determined all the same, and what it is called.
struct KnownCombination {
    LinearForm form;
    std::string text;  // "0.51 scale of X + 0.29 scale of Y", ...
    bool is_angle;     // of a set-up; else a slope
};

class Observability {
public:
    // Marks the tables' forms.
    Observability(const GaussNewton& solver, AdjustmentTables& tables);

    const std::vector<bool>& determined() const { return determined_; }
    // One sentence each: what is missing, why, and what would help.
    // `known`: by unknown; determined(), or less.
    std::vector<std::string> sentences(const std::vector<bool>& known) const;
    const std::vector<KnownCombination>& combinations() const { return combinations_; }

private:
    void combine_slopes(const Eigen::MatrixXd& slopes, const std::vector<FunctionId>& functions);
    void add_function_sentences(std::vector<std::string>& sentences) const;
    void add_setup_sentences(const std::vector<bool>& known, std::vector<std::string>& sentences) const;

    const AdjustmentProblem& problem_;
    const AdjustmentTables& tables_;
    std::vector<bool> determined_;
    std::vector<KnownCombination> combinations_;
};

}  // namespace stepdiag
