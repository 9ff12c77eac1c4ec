// Propagation of uncertainty (GUM, JCGM 100:2008). With y = f(x) and c_i = df/dx_i:
//   Cov(y) = C Cov(x) C^T,   u^2(y) = sum (c_i u_i)^2 for independent inputs
//   nu_eff = u^4(y) / sum u_i^4(y)/nu_i   (Welch-Satterthwaite, G.4.1),   U = t_p(nu_eff) u(y)   (G.6.4)
// For least squares, f(b) = A+ b and Cov(x) = A+ Cov(b) A+^T (eq. 6 of the paper).
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

struct PropagatedInput {
    std::string name;
    std::string group;  // group in the budget
    double standard_uncertainty;
    double degrees_of_freedom = std::numeric_limits<double>::infinity();
    // Inputs with the same number (0 or more) have standard uncertainties from one estimate (a pooled variance), whose
    // degrees of freedom count once. -1: the input has its own estimate.
    int estimate = -1;
    DistributionKind distribution = DistributionKind::normal;  // for the explanations of compare()
};

struct LinearModel {
    std::vector<SampleModel::Output> outputs;
    Eigen::VectorXd value;  // y at the inputs' expectations
    std::vector<PropagatedInput> inputs;
    Eigen::MatrixXd sensitivity;       // dy/dx: rows are outputs, columns are inputs
    Eigen::MatrixXd correlation = {};  // of the inputs; empty: independent inputs
};

// Result of a propagation, in native units and in the order of `outputs`.
struct Propagation {
    std::vector<SampleModel::Output> outputs;
    Eigen::VectorXd value;
    Eigen::VectorXd standard_uncertainty;
    // Effective degrees of freedom. NaN if correlated inputs with finite degrees of freedom contribute, because the
    // Welch-Satterthwaite formula is not valid for them.
    Eigen::VectorXd degrees_of_freedom;
    Eigen::MatrixXd covariance;  // empty unless requested

    // Uncertainty budget: u of each output (rows) from each group of inputs (columns). The sum of the squares plus
    // `between_groups` is u^2. `between_groups` is the part of u^2 from correlations between inputs of different
    // groups; it may be negative.
    std::vector<std::string> groups;
    Eigen::MatrixXd budget;
    Eigen::VectorXd between_groups;

    // Effects of inputs that are drawn once; reading noise is in the budget only. First order: c_i u_i. Second order:
    // (f(x + u_i) + f(x - u_i) - 2 f(x))/2, the effect of the squared deviation, which linear propagation neglects; 0
    // if unknown.
    std::vector<PropagatedInput> inputs;
    Eigen::MatrixXd first_order;  // rows are outputs, columns are inputs
    Eigen::MatrixXd second_order;

    // Effects of products of deviations by u_i and u_j, d_ij = u_i u_j d2f/dx_i dx_j: the strongest product of each
    // output, the sum of all squares (the variance contributed for independent inputs), and the shift of the mean for
    // correlated inputs. Unknown for linear models and for more than largest_product_inputs inputs.
    struct Product {
        Eigen::Index first = -1, second = -1;  // indices in `inputs`
        double value = 0.0;
    };
    bool knows_products = false;
    std::vector<Product> strongest_product;
    Eigen::VectorXd product_variance;
    Eigen::VectorXd product_shift;

    // Expanded uncertainty U = t_p u for this coverage probability. Degrees of freedom are truncated to integers
    // (G.4.1); U is NaN if they are NaN. Throws InvalidArgument for a coverage probability outside (0, 1).
    Eigen::VectorXd expanded(double coverage = 0.95) const;
    // Shift of the mean, and standard uncertainty, to second order: sum of second_order plus product_shift, and
    // sqrt(u^2 + 2 sum second_order^2 + product_variance) for independent normal inputs. Unknown products are omitted.
    Eigen::VectorXd second_order_shift() const;
    Eigen::VectorXd second_order_uncertainty() const;
};

// Propagates through a linear model. Throws InvalidArgument for inconsistent sizes, numbers that are not finite,
// negative uncertainties, degrees of freedom that are not positive, or a matrix that is not a correlation matrix.
Propagation propagate(const LinearModel& model, bool full_covariance = false);

inline constexpr Eigen::Index largest_product_inputs = 120;  // 14,280 evaluations

// Propagates through virtual calibrations. The sensitivity to an input is the central difference of whole calibrations
// at its expectation plus and minus its standard uncertainty. Reading noise is propagated with the gain of the
// evaluation and the full covariance of the noise: channels are independent, common noise is equal in all distances of
// a row, walks accumulate, and the repeatability of poses acts through its effect on each reading. A t distribution
// enters with its scale and degrees of freedom (GUM 4.2.3, G.3), not with its standard deviation. Throws
// InvalidArgument if the evaluation has no result for a deviation.
Propagation propagate(const VirtualCalibrations& calibrations, bool full_covariance = false);

// Uncertainty of a calibration that was evaluated from readings with full covariance. The group "readings" is the
// evaluation's own covariance (reading noise and the estimated set-ups). The inputs of `calibrations`, virtual
// calibrations of the same plan, head and evaluation, add their contributions; their reading noise is not used. The
// values are those of `calibration`. Throws InvalidArgument for a calibration with other parameters or nodes, or
// without covariance.
Propagation propagate(const Calibration& calibration, const VirtualCalibrations& calibrations,
                      bool full_covariance = false);

}  // namespace stepdiag
