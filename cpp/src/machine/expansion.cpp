#include "stepdiag/machine/expansion.hpp"

#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

void check(const Expansion& expansion) {
    constexpr double largest = 1e-3;  // 1/K; no solid expands by a tenth of it
    if (!(expansion.coefficient.cwiseAbs().maxCoeff() <= largest))
        throw InvalidArgument("expansion coefficient: expected three numbers from -1e-3 to 1e-3 per kelvin");
    if (!expansion.fixed_point.allFinite())
        throw InvalidArgument("expansion fixed_point: expected three finite lengths in mm");
    if (!std::isfinite(expansion.reference))
        throw InvalidArgument("expansion reference: expected a finite temperature in degrees Celsius");
}

}  // namespace stepdiag
