// Finds the brightest spot of an image, even if no single pixel is significant. It is the start of a fit.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace stepdiag {

struct FoundSpot {
    double x, y;       // pixels; pixel i extends from i to i + 1
    double size;       // edge of the square that contains about half of the spot's light, pixels
    double electrons;  // inside the square
};

// `excess`: electrons above the background; `read_variance`: of a pixel without light; `background`: electrons that add
// shot noise, 0 without shot noise. Empty if the spot has less than least_electrons or less than least_significance
// standard deviations.
std::optional<FoundSpot> find_spot(const Eigen::MatrixXd& excess, double read_variance, double background,
                                   bool shot_noise);

}  // namespace stepdiag
