// The branches into which a face divides incident light.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/path.hpp"

namespace stepdiag {

// Outgoing light: event, direction, medium, and share of the incident power.
struct Branch {
    Event event;
    Eigen::Vector3d direction;
    double index;
    double share;
};

// Transmitted light precedes reflected light. Only a splitting face has two branches. `index`: refractive index of the
// medium of the incident light; reflected light stays in it.
struct Branches {
    std::array<std::optional<Branch>, 2> onward;
    double absorbed;  // share of the incident power
};

Branches branches(const Face& face, const Medium& ambient, const Eigen::Vector3d& direction, double index);

}  // namespace stepdiag
