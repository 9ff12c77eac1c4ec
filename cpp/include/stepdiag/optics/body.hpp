// Flat faces with an outline.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stepdiag/optics/surface.hpp"

namespace stepdiag {

// A convex polygon in a plane. The plane is kept in double beside the outline, because it decides where a ray meets the
// face; planes rebuilt from single-precision vertices would be off by tenths of a micrometre.
struct Face {
    Eigen::Vector3d point;                 // of the plane, mm
    Eigen::Vector3d normal;                // unit
    std::vector<Eigen::Vector3d> outline;  // three or more corners in order, mm
    Surface surface;
};

// A rectangle in the local x-y plane of `scene_R_face`, centred at `centre`, normal along local z.
Face make_rectangle(const Eigen::Vector3d& centre, const Eigen::Matrix3d& scene_R_face, const Eigen::Vector2d& size,
                    Surface surface);

}  // namespace stepdiag
