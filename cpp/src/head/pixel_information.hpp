// Fisher information of one pixel about its mean m, for a Poisson number plus Gaussian noise of variance v:
//   I(m) = integral of p'^2/p over z
//   p = sum of Poisson(k; m) N(z; k, v)
//   p' = sum of Poisson(k; m) [N(z; k+1, v) - N(z; k, v)]
// It is between 1/(m + v), the information from the variance only, and 1/m. If single electrons can almost be counted,
// a dark pixel has more information than its variance suggests.
#pragma once

#include <vector>

namespace stepdiag {

class PixelInformation {
public:
    // `variance`: of the Gaussian noise, electrons^2, above 0. Without shot noise the information is 1/variance.
    PixelInformation(bool shot_noise, double variance);
    double operator()(double mean) const;

private:
    bool shot_noise_;
    double variance_;
    std::vector<double> log_gain_;  // ln of I (m + v) at equidistant ln m, for interpolation
};

}  // namespace stepdiag
