// Faces that light can meet. Embree (single precision) finds the face; the face's double plane gives the point.
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
    int face;  // as Scene::face counts them
    double distance;
    Eigen::Vector3d point;
};

class Scene {
public:
    // Throws InvalidArgument for a face with fewer than three corners, a corner off its plane, an outline that is not
    // convex, shares of the power that are outside 0 to 1 or together more than 1, an index below 1, or values not
    // finite; and where memory does not suffice for so many faces, naming how much they need (a million of four
    // corners: 0.3 GB beside their own 0.23 GB, and two seconds).
    explicit Scene(std::vector<Face> faces);

    // This scene and a few more faces, which are counted on from its own: a mirror that moves in front of a head. The
    // tree is shared, so that it costs no more than these faces do; but every ray is tested against each of them.
    Scene with(std::vector<Face> more) const;

    // The faces that the scene was made of, without those added.
    const std::vector<Face>& faces() const;

    int face_count() const;
    const Face& face(int index) const;

    // The nearest face farther than `self_intersection_gap()`; nothing is a miss.
    std::optional<Hit> first_hit(const Ray& ray) const;

    // Single precision cannot tell a face just left from one met at once: hits nearer than this are passed over, mm.
    double self_intersection_gap() const { return gap_; }

    // Bodies nearer to each other than this may lose a face to that, mm.
    double smallest_separation() const { return 4.0 * gap_; }

private:
    struct Tree;
    std::shared_ptr<const Tree> tree_;
    std::vector<Face> added_;
    double gap_;
};

}  // namespace stepdiag
