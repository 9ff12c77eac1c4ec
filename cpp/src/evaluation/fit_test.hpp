// Chi-square test of a fit, and the verdict that follows from it alone (docs/conventions.md, "Verdict of a fit").
// Internal.
#pragma once

#include <Eigen/Core>

#include "stepdiag/evaluation/thresholds.hpp"
#include "stepdiag/machine/fit.hpp"

namespace stepdiag {

// The probability of a larger square sum.
double chi_square_probability(double square_sum, double freedom);

// Of a chi-square test with so many degrees of freedom: the noncentrality with which it refuses with a probability of
// `power` what it refuses with the probability `alpha` if it is right.
double noncentrality(int freedom, double alpha, double power);

// The verdict if only the noise is tested: whether it is larger or smaller than stated by a common factor.
Fit fit_of_noise(double square_sum, int freedom);

struct ChiSquare {
    double square_sum;
    int freedom;
};
// values^T covariance^-1 values, with the rank of the covariance as degrees of freedom.
ChiSquare chi_square(const Eigen::VectorXd& values, const Eigen::MatrixXd& covariance);

// Sum of share share^T, added up in blocks.
class ShareSum {
public:
    explicit ShareSum(Eigen::Index size);
    template <class Share>
    void add(const Share& share) {
        for (Eigen::Index i = 0; i < shares_.rows(); ++i) shares_(i, count_) = share(std::size_t(i));
        if (++count_ == shares_.cols()) flush();
    }
    const Eigen::MatrixXd& matrix();

private:
    void flush();

    Eigen::MatrixXd sum_, shares_;
    Eigen::Index count_ = 0;
};

}  // namespace stepdiag
