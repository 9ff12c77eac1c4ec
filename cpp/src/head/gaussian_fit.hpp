// Maximum likelihood fit of a pixel-integrated Gaussian to an image, by Fisher scoring.
//   mean of a pixel  m = A X(x, w) Y(y, w) + b, with X and Y the spot's shares on the pixel's column and row
//   variance         v = m (shot noise) + read variance
//   score, information   g = sum (I - m)/v dm,  H = sum dm dm^T / v;  step H^-1 g
// This is exact for Poisson noise, and for Gaussian noise; for their sum it treats I + (read variance) as a Poisson
// number (F. Huang et al., Nature Methods 10 (2013) 653), which costs up to a tenth of the precision where pixels have
// less than one electron and the read noise is about one.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "head/pixel_information.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {

// In pixels (pixel i reaches from i to i + 1) and electrons.
struct PixelSpot {
    double x, y, radius, electrons, background;
};

// A part of the image.
struct PixelWindow {
    int column, row, columns, rows;
};

// What pixels are known to do.
struct PixelNoise {
    bool shot;
    double variance;    // without light, above 0
    double saturation;  // pixels of this or more tell nothing
};

struct FisherScoring {
    Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> score = Eigen::Matrix<double, 5, 1>::Zero();
};

// Of x, y, radius, electrons and background, in this order.
FisherScoring score(const Eigen::MatrixXd& image, const PixelWindow& window, const PixelNoise& noise,
                    const PixelSpot& spot);

// The exact information of all pixels whose mean is below saturation.
Eigen::Matrix<double, 5, 5> information(const PixelWindow& window, const PixelInformation& of_pixel, double saturation,
                                        const PixelSpot& spot);

// H^-1 b; none where H is not positive definite, that is, where the parameters cannot all be told.
std::optional<Eigen::Matrix<double, 5, 1>> solve(const Eigen::Matrix<double, 5, 5>& information,
                                                 const Eigen::Matrix<double, 5, 1>& b);

// None where the iteration does not converge or leaves the image.
std::optional<PixelSpot> fit_gaussian(const Eigen::MatrixXd& image, const PixelNoise& noise, PixelSpot start);

}  // namespace stepdiag
