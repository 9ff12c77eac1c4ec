// Finds the brightest spot of an image, so that a fit knows where to begin even where no single pixel stands out.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace stepdiag {

struct FoundSpot {
    double x, y;       // pixels; pixel i reaches from i to i + 1
    double size;       // edge of the square that holds about half of its light, pixels
    double electrons;  // inside the square
};

// `excess`: electrons above the background; `read_variance`: of a pixel without light; `background`: that of the shot
// noise, 0 without. None where less than least_electrons or least_significance standard deviations stand out.
std::optional<FoundSpot> find_spot(const Eigen::MatrixXd& excess, double read_variance, double background,
                                   bool shot_noise);

}  // namespace stepdiag
