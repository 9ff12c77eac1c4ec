// What a camera's pixels are known to do: the converter's step, the noise, and the values that mean saturation.
#pragma once

#include <cmath>

#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {

// Electrons between two numbers of the converter; 0: none.
inline double converter_step(const Camera& camera) {
    return camera.bits == 0 ? 0.0 : camera.full_well / (std::ldexp(1.0, camera.bits) - 1.0);
}

// Variance of a pixel that has no light, electrons^2.
inline double read_variance(const Camera& camera) {
    const double step = converter_step(camera);
    return camera.read_noise * camera.read_noise + step * step / 12.0;
}

// A pixel above this may have been full: read noise can only have lowered it.
inline double saturation(const Camera& camera) {
    return camera.full_well - 5.0 * camera.read_noise - 0.5 * converter_step(camera);
}

}  // namespace stepdiag
