// What one pixel tells about its mean: the Fisher information of a Poisson number with Gaussian noise added,
//   I(m) = integral of p'^2/p,  p = sum of Poisson(k; m) N(z; k, v),  p' = sum of Poisson(k; m) [N(z; k+1, v) - N(z; k,
//   v)]
// It lies between 1/(m + v), what the variance alone promises, and 1/m: where electrons can nearly be counted one by
// one, a dark pixel tells more than its variance says.
#pragma once

#include <vector>

namespace stepdiag {

class PixelInformation {
public:
    // Without shot noise: 1/variance. `variance`: of the Gaussian, electrons^2, above 0.
    PixelInformation(bool shot_noise, double variance);
    double operator()(double mean) const;

private:
    bool shot_noise_;
    double variance_;
    std::vector<double> log_gain_;  // ln of I (m + v) over ln m; interpolated between
};

}  // namespace stepdiag
