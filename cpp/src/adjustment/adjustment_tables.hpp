// From the adjustment's unknowns to the tables of a calibration: straightnesses without their slopes, squarenesses, and
// reversal errors, each a sum of a few unknowns. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment/bordered_band.hpp"

namespace stepdiag {

// sum coefficient x[unknown]
struct LinearForm {
    std::array<int, 6> unknown{};
    std::array<double, 6> coefficient{};
    int size = 0;
    bool determined = true;  // no null vector of the problem changes it (observability.hpp)

    void add(int index, double factor);  // nothing for no_unknown
    void subtract(const LinearForm& other);
    double value(const Eigen::VectorXd& x) const;
    BorderedFactor::OfSides values(const BorderedFactor::Sides& x) const;
    double variance(const BorderedBand& inverse) const;
};

// The nodes of a function that are (or may be) determined, and what each of its values is. Home is among them, with an
// empty form.
struct FunctionForms {
    std::vector<double> position;
    std::vector<LinearForm> value;
};

// Everything that a calibration may tell.
class AdjustmentTables {
public:
    explicit AdjustmentTables(const AdjustmentProblem& problem);

    std::vector<LinearForm*> all();  // to mark what is determined

    // As the values themselves; as their shape, with both ends at 0. Straightnesses have only the second, in either.
    const FunctionForms& values(FunctionId id) const { return values_[id.index()]; }
    const FunctionForms& shapes(FunctionId id) const { return shapes_[id.index()]; }
    const std::optional<LinearForm>& squareness(Squareness s) const { return squareness_[static_cast<int>(s)]; }
    // The slope of a function, per travel: what its value at the end of travel is. None where no reading visits it.
    const std::optional<LinearForm>& slope(FunctionId id) const { return slopes_[id.index()]; }
    // + minus -; and the same, less its value at home. Empty where only one direction is there.
    const FunctionForms& reversal(FunctionId id) const { return reversal_[id.index()]; }
    const FunctionForms& reversal_change(FunctionId id) const { return reversal_change_[id.index()]; }

private:
    void make_function(const AdjustmentProblem& problem, FunctionId id);
    void make_reversal(const AdjustmentProblem& problem, FunctionId id);

    std::array<FunctionForms, function_count> values_, shapes_, reversal_, reversal_change_;
    std::array<std::optional<LinearForm>, function_count> slopes_;
    std::array<std::optional<LinearForm>, squareness_count> squareness_;
};

}  // namespace stepdiag
