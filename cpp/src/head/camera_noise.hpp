// Properties of a camera's pixels: step of the converter, noise, and level of saturation. All in electrons.
#pragma once

#include <cmath>

#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {

// Electrons per step of the converter; 0 if the camera does not quantise.
inline double converter_step(const Camera& camera) {
    return camera.bits == 0 ? 0.0 : camera.full_well / (std::ldexp(1.0, camera.bits) - 1.0);
}

// Variance of a pixel without light, electrons^2.
inline double read_variance(const Camera& camera) {
    const double step = converter_step(camera);
    return camera.read_noise * camera.read_noise + step * step / 12.0;
}

// A pixel above this level may have been saturated before read noise lowered its value.
inline double saturation(const Camera& camera) {
    return camera.full_well - 5.0 * camera.read_noise - 0.5 * converter_step(camera);
}

}  // namespace stepdiag
