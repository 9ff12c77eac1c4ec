// Exact first derivatives of the end of a route with respect to one parameter. The replay is calculated with dual
// numbers (dual.hpp). A parameter may move faces rigidly, change refractive indices, and move the source. For a face
// with local = R x + t that rotates by `rotation` about `about` and moves by `shift`:
//   R' = -R [rotation]x,   t' = R (rotation x about - shift)
// Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/dual.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/replay.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

// Rigid motion to first order per unit of a parameter. The default is no motion.
struct RigidRate {
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  // rotation vector, rad per unit
    Eigen::Vector3d about = Eigen::Vector3d::Zero();     // fixed point of the rotation, mm
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();     // mm per unit
};

struct DualFrame {
    std::array<Dual, 9> rotation;
    std::array<Dual, 3> translation;
};
DualFrame moving(const FaceFrame& frame, const RigidRate& rate = {});

// An Encounter of a single ray.
struct DualEncounter {
    Event event;
    bool deflects = true;
    DualFrame frame;
    const Outline* outline;
    Dual index_before, index_after;
};

// A ray at the start or at the end of a route.
struct DualRay {
    std::array<Dual, 3> point, direction;
    Dual optical_length = {};  // sum of n t, mm
    Dual reduced_length = {};  // sum of t / n, mm
};
DualRay moving(const Ray& ray, const RigidRate& rate = {});

// Empty if one of the checks of the replay fails. The checks use the values only; a derivative does not show that an
// edge is near.
std::optional<DualRay> replay(const std::vector<DualEncounter>& route, const DualRay& ray, double gap);

}  // namespace stepdiag
