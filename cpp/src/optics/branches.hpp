// Where light goes from a face that it meets.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/path.hpp"

namespace stepdiag {

// Light that goes on: what happened to it, where to, in which medium, and its share of the power that came.
struct Branch {
    Event event;
    Eigen::Vector3d direction;
    double index;
    double share;
};

// Transmitted light stands before reflected light; two ways only from a splitting face. `index`: of the medium that the
// light comes in, which it keeps where it is reflected.
struct Branches {
    std::array<std::optional<Branch>, 2> onward;
    double absorbed;  // share of the power
};

Branches branches(const Face& face, const Medium& ambient, const Eigen::Vector3d& direction, double index);

}  // namespace stepdiag
