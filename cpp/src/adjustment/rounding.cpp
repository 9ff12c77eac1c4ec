#include "adjustment/rounding.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace stepdiag {
namespace {
constexpr double epsilon = std::numeric_limits<double>::epsilon();
}

double double_rounding(HeadLayout kind, int channel, double longest) {
    constexpr double of_tilt = 8.0 * epsilon;  // components of unit vectors, multiplied through the chain
    if (kind == HeadLayout::multi_beam || channel == 0) return epsilon * longest;
    return kind == HeadLayout::psd ? 2.0 * of_tilt * longest : of_tilt;  // a spot moves by the double path
}

double decimal_step(const std::vector<double>& values, const std::vector<double>& planned, double unit) {
    constexpr int coarsest = -2, most_decimals = 9;  // of decimals: from hundreds of units
    constexpr double unclear = 1e-3;                 // of a step: as much may be rounding
    constexpr std::size_t enough = 5;                // places beside the plan; fewer may be chance
    constexpr double told = 100.0;                   // places a step: the plan has lengths between the multiples
    double size = 0.0;
    for (const double value : values) size = std::max(size, std::abs(value));
    double per_unit = std::pow(10.0, coarsest) / unit;
    for (int decimals = coarsest; decimals <= most_decimals; ++decimals, per_unit *= 10.0) {
        if (4.0 * epsilon * size * per_unit > unclear) return 0.0;
        const bool is_multiple = std::all_of(values.begin(), values.end(), [&](double value) {
            return std::abs(value * per_unit - std::round(value * per_unit)) <= unclear;
        });
        if (!is_multiple) continue;
        std::set<double> beside;
        for (std::size_t i = 0; i < values.size() && beside.size() < enough; ++i)
            beside.insert(std::round((values[i] - planned[i]) * per_unit * told));
        return beside.size() < enough ? 0.0 : 1.0 / per_unit;
    }
    return 0.0;
}

}  // namespace stepdiag
