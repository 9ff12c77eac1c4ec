// A calibration as knowledge: its values between the nodes, and a root of their covariance, as far as positions that
// are read again depend on it. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "adjustment/channel_model.hpp"
#include "stepdiag/evaluation/calibration.hpp"
#include "stepdiag/recheck/recheck.hpp"

namespace stepdiag {

class Baseline {
public:
    // A value of the calibration (order of calibration_entries) that has a share in an error of an axis.
    struct Share {
        int entry;
        int component;  // of AxisErrors
        double weight;
    };

    using Positions = std::array<std::vector<double>, 3>;  // by axis, mm

    // `read`: the positions that are read again. The machine may also have changed. Throws InvalidArgument for a
    // calibration without covariance, for one that does not determine all parameters, and for priors that make no
    // sense.
    Baseline(Calibration calibration, const ChangePriors& priors, const Positions& read);

    const Calibration& calibration() const { return calibration_; }
    // Errors of an axis, squareness terms included; `negative`: approached in - direction. Appends to `shares`.
    AxisErrors errors(Axis axis, double position, bool negative, std::vector<Share>& shares) const;
    bool is_node(Axis axis, double position) const;  // of all functions of the axis
    // values = calibration_values + root z + rest, where z has independent components of variance 1, and the rest is
    // independent of it and 0 at what is read.
    const Eigen::MatrixXd& root() const { return root_; }
    // The root's columns up to here are of the calibration's covariance; then come slopes that it does not determine.
    Eigen::Index own_columns() const { return own_columns_; }
    Eigen::MatrixXd rest_covariance() const;
    // A column of the root each, the last ones, with their priors; values are not estimated here.
    const std::vector<ChangeTerm>& changes() const { return changes_; }
    Eigen::MatrixXd shape() const;  // by a change of 1 of each term: of each entry

private:
    std::vector<int> read_entries(const Positions& read) const;
    void find_root(const std::vector<int>& entries);
    void add_change(const ChangeTerm& change);

    Calibration calibration_;
    std::array<int, function_count + squareness_count> first_entry_;
    Eigen::MatrixXd root_;
    Eigen::Index own_columns_;
    std::vector<ChangeTerm> changes_;
};

}  // namespace stepdiag
