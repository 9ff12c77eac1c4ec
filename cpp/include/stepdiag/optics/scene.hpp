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
    int face;  // index into Scene::faces()
    double distance;
    Eigen::Vector3d point;
};

class Scene {
public:
    // Throws InvalidArgument for a face with fewer than three corners, a corner off its plane, an outline that is not
    // convex, or values not finite.
    explicit Scene(std::vector<Face> faces);

    const std::vector<Face>& faces() const { return faces_; }

    // The nearest face farther than `self_intersection_gap()`; nothing is a miss.
    std::optional<Hit> first_hit(const Ray& ray) const;

    // Single precision cannot tell a face just left from one met at once: hits nearer than this are passed over, mm.
    double self_intersection_gap() const { return gap_; }

private:
    std::vector<Face> faces_;
    Eigen::Vector3d centre_;  // Embree's origin: its coordinates stay small, so that single precision goes a long way
    double gap_;
    std::shared_ptr<void> embree_;
};

}  // namespace stepdiag
