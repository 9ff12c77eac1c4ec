// Probability distributions of input quantities (JCGM 101:2008, 6.4), given by expectation and spread.
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
    student_t,              // spread: scale s/sqrt(n); has `degrees_of_freedom`
    curvilinear_trapezoid,  // spread: half width, known only within +-`edge` (JCGM 101, 6.4.3)
};
std::string name(DistributionKind kind);                            // "normal", ..., "t", "curvilinear_trapezoid"
DistributionKind parse_distribution_kind(const std::string& name);  // throws InvalidArgument

struct Distribution {
    DistributionKind kind = DistributionKind::normal;
    double expectation = 0.0;
    double spread = 0.0;  // 0: a constant
    // Parameter of a t distribution. For other kinds: degrees of freedom of the standard uncertainty (GUM G.4),
    // infinite for an exactly known uncertainty.
    double degrees_of_freedom = std::numeric_limits<double>::infinity();
    double edge = 0.0;  // for a curvilinear trapezoid only

    // Normal sigma; rectangular w/sqrt(3); triangular w/sqrt(6); arcsine w/sqrt(2); t s sqrt(nu/(nu - 2)); curvilinear
    // trapezoid sqrt(w^2/3 + d^2/9).
    double standard_uncertainty() const;
};

// Throws InvalidArgument, whose message begins with `name`, for an expectation or spread that is not finite, a negative
// spread, an edge outside 0 to the spread (other kinds: an edge other than 0), degrees of freedom that are not
// positive, or a t distribution with two or fewer degrees of freedom, which has no standard uncertainty.
void check(const Distribution& distribution, const std::string& name);

// Transforms random numbers to the distribution. `normal` is a standard normal number; u and v are uniform in (0, 1).
// The kind normal uses `normal`; student_t and curvilinear_trapezoid use u and v; the others use u. The t distribution
// uses the polar formula of Bailey, Mathematics of Computation 62 (1994) 779.
double draw(const Distribution& distribution, double normal, double u, double v);

// Jointly normal inputs. `members` are the indices of the inputs, which must be normal; `correlation` is their
// correlation matrix.
struct CorrelatedInputs {
    std::vector<int> members;
    Eigen::MatrixXd correlation;
};

// F with F F^T = `correlation`. F times independent standard normal numbers has this correlation. Semidefinite matrices
// are valid. Throws InvalidArgument, whose message begins with `name`, if the matrix is not a correlation matrix.
Eigen::MatrixXd correlation_factor(const Eigen::MatrixXd& correlation, const std::string& name);

// Quantile functions of the standard normal and the t distribution (for coverage factors). Throw InvalidArgument for a
// probability outside (0, 1), or degrees of freedom that are not positive.
double normal_quantile(double probability);
double t_quantile(double probability, double degrees_of_freedom);

}  // namespace stepdiag
