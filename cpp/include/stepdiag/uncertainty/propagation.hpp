// Propagation of uncertainty (GUM, JCGM 100): with y = f(x), c_i = df/dx_i,
//   Cov(y) = C Cov(x) C^T,   u^2(y) = sum (c_i u_i)^2 where inputs are independent
//   nu_eff = u^4(y) / sum u_i^4(y)/nu_i   (Welch-Satterthwaite, G.4.1),   U = t_p(nu_eff) u(y)   (G.6.4)
// Least squares is the case f(b) = A+ b: Cov(x) = A+ Cov(b) A+^T (eq. 6 of the paper).
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag {

struct PropagatedInput {
    std::string name;
    std::string group;  // of the budget
    double standard_uncertainty;
    double degrees_of_freedom = std::numeric_limits<double>::infinity();
    // Inputs with the same number, 0 or more, take their standard uncertainties from one estimate (a pooled variance),
    // so that its degrees of freedom count once; -1: from its own.
    int estimate = -1;
    DistributionKind distribution = DistributionKind::normal;  // for the words of a comparison
};

struct LinearModel {
    std::vector<SampleModel::Output> outputs;
    Eigen::VectorXd value;  // y at the inputs' expectations
    std::vector<PropagatedInput> inputs;
    Eigen::MatrixXd sensitivity;       // dy/dx, a row each output
    Eigen::MatrixXd correlation = {};  // of the inputs; empty: none
};

// Native units, in the order of `outputs`.
struct Propagation {
    std::vector<SampleModel::Output> outputs;
    Eigen::VectorXd value;
    Eigen::VectorXd standard_uncertainty;
    // Effective degrees of freedom. NaN where Welch-Satterthwaite does not apply: correlated inputs with finite degrees
    // of freedom contribute.
    Eigen::VectorXd degrees_of_freedom;
    Eigen::MatrixXd covariance;  // empty unless asked for

    // The budget: u of each output by each group of inputs alone, a row each output, a column each group. The squares
    // sum to u^2 but for `between_groups`, the part of u^2 by correlation between inputs of two groups (either sign).
    std::vector<std::string> groups;
    Eigen::MatrixXd budget;
    Eigen::VectorXd between_groups;

    // Of inputs that are drawn once (reading noise is in the budget alone): c_i u_i, and what the square of a deviation
    // by u_i does, (f(x + u_i) + f(x - u_i) - 2 f(x))/2, which linear propagation leaves out; 0 where not known.
    std::vector<PropagatedInput> inputs;
    Eigen::MatrixXd first_order;  // a row each output, a column each input
    Eigen::MatrixXd second_order;

    // What products of two deviations by u_i and u_j do, d_ij = u_i u_j d2f/dx_i dx_j: the strongest of each output,
    // the sum of all squares (the variance they make with independent inputs), the shift of the mean where inputs are
    // correlated. Not known of linear models and of more than largest_product_inputs inputs.
    struct Product {
        Eigen::Index first = -1, second = -1;  // of `inputs`
        double value = 0.0;
    };
    bool knows_products = false;
    std::vector<Product> strongest_product;
    Eigen::VectorXd product_variance;
    Eigen::VectorXd product_shift;

    // U = t_p u for this coverage probability, of degrees of freedom truncated to whole ones (G.4.1); NaN where they
    // are.
    Eigen::VectorXd expanded(double coverage = 0.95) const;
    // The mean's shift and the standard uncertainty to second order: sum of second_order, with product_shift;
    // sqrt(u^2 + 2 sum second_order^2 + product_variance), of independent normal inputs. Without products where these
    // are not known.
    Eigen::VectorXd second_order_shift() const;
    Eigen::VectorXd second_order_uncertainty() const;
};

// Throws InvalidArgument for sizes that do not fit, uncertainties that are negative or not finite, degrees of freedom
// not above 0, a correlation that is none.
Propagation propagate(const LinearModel& model, bool full_covariance = false);

inline constexpr Eigen::Index largest_product_inputs = 120;  // 14,280 evaluations

// Of virtual calibrations: every input by central differences of whole calibrations at its expectation plus and minus
// its standard uncertainty; reading noise by the evaluation's gain with its real covariance (channels independent,
// common noise the same in all distances of a reading, walks summed up, repeatability of poses through what a pose does
// to each reading). `run` is what `calibrations` was made of. A t distribution counts with its scale and degrees of
// freedom (GUM 4.2.3, G.3), not with its standard deviation.
// Throws InvalidArgument where a deviation leaves the evaluation without a result.
Propagation propagate(const VirtualCalibrations& calibrations, bool full_covariance = false);

// Of a calibration that was evaluated from readings with full covariance: the group "readings" is what the evaluation
// itself says (reading noise and the set-ups it solved for); to it comes what the inputs of `calibrations`, virtual
// ones of the same plan, head and evaluation, contribute; their reading noise does not. Values are the calibration's
// own.
Propagation propagate(const Calibration& calibration, const VirtualCalibrations& calibrations,
                      bool full_covariance = false);

}  // namespace stepdiag
