// The way from the mirror through a head whose faces are parallel to its reference plane, as one step. Behind a
// reflecting face a head is taken for its mirror image, so that light goes straight on (tunnel diagram): a cube
// splitter is a plate as a window is. Plates in air shift light sideways and do not turn it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/replay.hpp"

namespace stepdiag {

struct BeamPath;

// Of the scene as mirrored by the reflecting faces so far: scene = rotation unfolded + shift.
struct Unfolding {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // orthogonal, of determinant 1 or -1
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();

    FaceFrame of(const FaceFrame& frame) const;
    Placement of(const Placement& placement) const;
    void reflect(const FaceFrame& frame);  // at this face of the scene
};

struct Plates {
    struct Glass {
        double index, thickness;  // of all plates of this glass
    };

    double first, last;  // z of the first and the last face, mm; light comes from above
    std::vector<Glass> glasses = {};
    Eigen::Vector2d centre, half_size;  // of the rectangle in x-y that is inside the outlines of all faces
    std::size_t faces = 0;              // of the path
    Unfolding unfolding = {};           // of what follows
};

// None where the first face behind the mirror is inclined or on a component that moves (`moves`, by component), or
// where light does not leave the last plate into the air. A light path that is inside the rectangle at the mirror and
// at the last face is inside it all the way.
std::optional<Plates> plates_of(const BeamPath& path, const std::vector<bool>& moves, double gap);

}  // namespace stepdiag
