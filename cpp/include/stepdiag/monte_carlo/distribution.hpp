// The distributions that JCGM 101 (6.4) assigns to input quantities, by expectation and spread.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

namespace stepdiag {

enum class DistributionKind {
    normal,                 // spread: standard deviation
    rectangular,            // spread: half width
    triangular,             // spread: half width
    arcsine,                // spread: half width (U-shaped: a sinusoid of unknown phase)
    student_t,              // spread: scale s/sqrt(n); `degrees_of_freedom`
    curvilinear_trapezoid,  // spread: half width, itself known to plus and minus `edge` only (JCGM 101, 6.4.3)
};
std::string name(DistributionKind kind);  // "normal", ..., "t", "curvilinear_trapezoid"
DistributionKind parse_distribution_kind(const std::string& name);

struct Distribution {
    DistributionKind kind = DistributionKind::normal;
    double expectation = 0.0;
    double spread = 0.0;  // 0: the expectation itself
    // Of a t distribution; of others those of their standard uncertainty (GUM G.4), infinite where it is known.
    double degrees_of_freedom = std::numeric_limits<double>::infinity();
    double edge = 0.0;  // of a curvilinear trapezoid only

    // Normal sigma; rectangular w/sqrt(3); triangular w/sqrt(6); arcsine w/sqrt(2); t s sqrt(nu/(nu - 2)); curvilinear
    // trapezoid sqrt(w^2/3 + d^2/9).
    double standard_uncertainty() const;
};

// Throws InvalidArgument, beginning with `name`, for an expectation or spread that is not finite, a spread below 0, an
// edge that is not between 0 and the spread (of other kinds: not 0), degrees of freedom not above 0, or a t
// distribution with two or fewer: it has no standard uncertainty.
void check(const Distribution& distribution, const std::string& name);

// A number drawn: from `normal`, a standard normal number, or from uniform numbers in (0, 1), as many as the kind
// takes: normal takes `normal`; student_t and curvilinear_trapezoid u and v; the others u. (t by the polar formula of
// Bailey, Mathematics of Computation 62 (1994) 779.)
double draw(const Distribution& distribution, double normal, double u, double v);

// Inputs that are jointly normal: `members` index the inputs, all of them normal.
struct CorrelatedInputs {
    std::vector<int> members;
    Eigen::MatrixXd correlation;
};

// F with F F^T = `correlation`: F times independent standard normal numbers has that correlation. Semidefinite ones are
// taken too. Throws InvalidArgument, beginning with `name`, for what is no correlation matrix.
Eigen::MatrixXd correlation_factor(const Eigen::MatrixXd& correlation, const std::string& name);

// The quantile function: of a normal, of a t distribution (coverage factors). Throws InvalidArgument for a probability
// outside (0, 1) and degrees of freedom not above 0.
double normal_quantile(double probability);
double t_quantile(double probability, double degrees_of_freedom);

}  // namespace stepdiag
