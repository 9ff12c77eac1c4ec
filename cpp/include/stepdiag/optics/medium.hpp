// What light travels through.
#pragma once

namespace stepdiag {

// A medium of constant refractive index.
struct Medium {
    double index = 1.0;
};

}  // namespace stepdiag
