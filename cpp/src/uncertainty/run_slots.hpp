// Which number of a virtual run stands where.
#pragma once

namespace stepdiag {

// The numbers of a line's set-up, nominal or with deviations: those of Misalignment, and of its scale.
namespace slot {
enum : int {
    reflector = 0,  // a, b
    laser = 2,      // a, b
    lateral = 4,    // x, y
    roll = 6,
    gain = 7,
    psd_zero = 8,  // x, y
    distance_constant = 10,
    drift = 11,
    scale_length = 12,
    scale_factor = 13,
    beam_constant = 14,  // d1 ... dn
};
}
// The numbers that all lines share.
namespace shared_slot {
enum : int {
    reading_model = 0,
    temperature = 1,
    pressure = 2,
    humidity = 3,
    refractive_index = 4,
    wavelength = 5,
    machine_drift = 6,  // x, y, z
    psd_distance = 9,
    beam_offset = 10,  // u, v of d1 ... dn
};
}

}  // namespace stepdiag
