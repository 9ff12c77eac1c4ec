// The faces that light can meet. Embree (single precision) finds the face that a ray meets; the face's plane in double
// precision gives the point. Lengths in mm, scene frame.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "stepdiag/optics/body.hpp"

namespace stepdiag {

struct Ray {
    Eigen::Vector3d origin;     // mm
    Eigen::Vector3d direction;  // unit
};

struct Hit {
    int face;               // index for Scene::face
    double distance;        // from the ray's origin, mm
    Eigen::Vector3d point;  // mm
};

class Scene {
public:
    // Throws InvalidArgument for a face with fewer than three corners, a corner off its plane, an outline that is not
    // convex, shares of the power outside 0 to 1 or with a sum above 1, an index below 1, or values that are not
    // finite. Also throws it if memory is insufficient; the message states the required memory. A million faces of
    // four corners take 0.3 GB in addition to their own 0.23 GB, and two seconds.
    explicit Scene(std::vector<Face> faces);

    // This scene with a few more faces, such as a mirror that moves in front of a head. Their indices follow those of
    // this scene. The search tree is shared, so the new scene is cheap to make, but every ray is tested against each
    // added face.
    Scene with(std::vector<Face> more) const;

    // The faces of the constructor, without those added by with().
    const std::vector<Face>& faces() const;

    int face_count() const;
    const Face& face(int index) const;

    // The nearest face at a distance of more than `self_intersection_gap()`; empty for a miss.
    std::optional<Hit> first_hit(const Ray& ray) const;

    // Closer hits are ignored, mm: single precision cannot distinguish the face that a ray leaves from a face that it
    // meets immediately.
    double self_intersection_gap() const { return gap_; }

    // Smallest distance between bodies, mm. For closer bodies, the gap above may hide a face.
    double smallest_separation() const { return 4.0 * gap_; }

private:
    struct Tree;
    std::shared_ptr<const Tree> tree_;
    std::vector<Face> added_;
    double gap_;
};

}  // namespace stepdiag
