// Sums the contributions of inputs to the uncertainty of the outputs: variances, budget, covariance, and effective
// degrees of freedom (Welch-Satterthwaite). Internal.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/propagation.hpp"

namespace stepdiag {

class Contributions {
public:
    Contributions(std::vector<SampleModel::Output> outputs, Eigen::VectorXd value, bool full_covariance);

    // Adds independent standard normal quantities that act through the columns of `effect` (rows are outputs). Their
    // standard uncertainties come from one estimate with these degrees of freedom.
    void add(const std::string& group, const Eigen::MatrixXd& effect, double degrees_of_freedom);
    // Adds a covariance of the outputs.
    void add_covariance(const std::string& group, const Eigen::MatrixXd& covariance);
    // Adds inputs. `first_order`: columns c_i u_i; `correlation`: of the inputs, empty for independent inputs.
    void add_inputs(const std::vector<PropagatedInput>& inputs, const Eigen::MatrixXd& first_order,
                    const Eigen::MatrixXd& second_order, const Eigen::MatrixXd& correlation);

    Propagation result() const;

private:
    Eigen::VectorXd& group_variance(const std::string& group);
    void add_estimate(const Eigen::VectorXd& variance, double degrees_of_freedom);

    Propagation sum_;
    bool full_covariance_;
    Eigen::VectorXd variance_;
    Eigen::VectorXd satterthwaite_;  // sum u_i^4/nu_i
    std::vector<std::string> groups_;
    std::vector<Eigen::VectorXd> group_variances_;
};

// Checks size, symmetry, 1 on the diagonal, and that the matrix is positive semidefinite. Throws InvalidArgument, whose
// message begins with `what`.
void check_correlation(const Eigen::MatrixXd& correlation, Eigen::Index size, const std::string& what);

}  // namespace stepdiag
