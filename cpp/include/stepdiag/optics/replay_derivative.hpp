// First derivatives of where a route ends, by one parameter at a time: exact, because the replay itself is calculated
// with numbers that carry their slope (dual.hpp). A parameter may move faces rigidly, change indices, and move the
// source:
//   local = R x + t of a face that is turned by `rotation` about `about` and shifted: R' = -R [rotation]x,
//   t' = R (rotation x about - shift)
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "stepdiag/core/dual.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/replay.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

// First-order rigid motion for each unit of a parameter; none unless given.
struct RigidRate {
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  // rotation vector, rad per unit
    Eigen::Vector3d about = Eigen::Vector3d::Zero();     // what the rotation leaves in place, mm
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();     // mm per unit
};

struct DualFrame {
    std::array<Dual, 9> rotation;
    std::array<Dual, 3> translation;
};
DualFrame moving(const FaceFrame& frame, const RigidRate& rate = {});

// As Encounter, of one lane.
struct DualEncounter {
    Event event;
    bool deflects = true;
    DualFrame frame;
    const Outline* outline;
    Dual index_before, index_after;
};

// A ray at its start, or where it ends.
struct DualRay {
    std::array<Dual, 3> point, direction;
    Dual optical_length = {};  // sum of n t, mm
    Dual reduced_length = {};  // sum of t / n, mm
};
DualRay moving(const Ray& ray, const RigidRate& rate = {});

// None where one of replay's checks fails. The checks are those of the values: a slope says nothing of an edge nearby.
std::optional<DualRay> replay(const std::vector<DualEncounter>& route, const DualRay& ray, double gap);

}  // namespace stepdiag
