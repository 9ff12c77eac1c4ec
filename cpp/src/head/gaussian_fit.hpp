// Maximum likelihood fit of a pixel-integrated Gaussian to an image, by Fisher scoring.
//   mean of a pixel  m = A X(x, w) Y(y, w) + b; X and Y are the spot's shares on the pixel's column and row
//   variance         v = m (shot noise) + read variance
//   score, information   g = sum (I - m)/v dm,  H = sum dm dm^T / v;  step H^-1 g
// The likelihood is exact for Poisson noise and for Gaussian noise. For their sum, I + (read variance) is treated as a
// Poisson number (F. Huang et al., Nature Methods 10 (2013) 653). This costs up to a tenth of the precision if pixels
// have less than one electron and the read noise is about one electron.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "head/pixel_information.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {

// A spot in pixels (pixel i extends from i to i + 1) and electrons.
struct PixelSpot {
    double x, y, radius, electrons, background;
};

// A part of the image.
struct PixelWindow {
    int column, row, columns, rows;
};

// Noise of the pixels.
struct PixelNoise {
    bool shot;
    double variance;    // of a pixel without light, electrons^2, above 0
    double saturation;  // electrons; pixels at or above this level have no information
};

struct FisherScoring {
    Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> score = Eigen::Matrix<double, 5, 1>::Zero();
};

// Score and information for x, y, radius, electrons and background, in this order.
FisherScoring score(const Eigen::MatrixXd& image, const PixelWindow& window, const PixelNoise& noise,
                    const PixelSpot& spot);

// Exact Fisher information of all pixels whose mean is below saturation.
Eigen::Matrix<double, 5, 5> information(const PixelWindow& window, const PixelInformation& of_pixel, double saturation,
                                        const PixelSpot& spot);

// H^-1 b. Empty if H is not positive definite: the image does not determine all parameters.
std::optional<Eigen::Matrix<double, 5, 1>> solve(const Eigen::Matrix<double, 5, 5>& information,
                                                 const Eigen::Matrix<double, 5, 1>& b);

// Empty if the iteration does not converge or leaves the image.
std::optional<PixelSpot> fit_gaussian(const Eigen::MatrixXd& image, const PixelNoise& noise, PixelSpot start);

}  // namespace stepdiag
