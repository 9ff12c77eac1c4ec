// Linear functionals of the 21 parameters: sums of coefficient times parameter at a position. Internal.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "stepdiag/evaluation/calibration.hpp"

namespace stepdiag {

// One term: an error function at a position, or a squareness. The coefficient of a squareness includes the position.
struct Term {
    int parameter;    // FunctionId::index(), or function_count + Squareness
    double position;  // mm; 0 for a squareness
    double coefficient;
};
using Functional = std::vector<Term>;

// Deviations X, Y, Z (functional point, mm), A, B, C (tool, rad) at a commanded point, to first order.
std::array<Functional, 6> deviations_at(const Chain& chain, const Eigen::Vector3d& tool, const Eigen::Vector3d& point);

// Position of each parameter's entries in the values of a calibration.
class EntryLayout {
public:
    explicit EntryLayout(const Calibration& calibration);

    Eigen::Index size() const { return size_; }
    // Coefficients for all entries. Absent parameters are omitted.
    Eigen::VectorXd row(const Functional& functional) const;
    // Parameters of the functional that the calibration does not have: "EAX", "slope of EXX", "C0Y".
    std::vector<std::string> missing(const Functional& functional) const;
    // The value of a function at a position is the sum of weight x entry.
    struct Weighted {
        Eigen::Index entry;
        double weight;
    };
    std::array<Weighted, 2> interpolation(int function, double position) const;
    bool has(int parameter) const { return first_[std::size_t(parameter)] >= 0; }
    Eigen::Index first(int parameter) const { return first_[std::size_t(parameter)]; }

private:
    std::array<Eigen::Index, function_count + squareness_count> first_;  // -1 for an absent parameter
    std::array<bool, function_count> has_slope_;
    std::array<std::vector<double>, function_count> positions_;
    Eigen::Index size_ = 0;
};

std::string parameter_name(int parameter);

}  // namespace stepdiag
