// The way of one ray through a scene.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

enum class PathEnd { absorbed, missed, too_many_hits };

struct Path {
    std::vector<Hit> hits;
    Eigen::Vector3d direction;  // of the last segment
    PathEnd end;
    double geometric_length;  // from the origin to the last hit, mm
    double optical_length;    // sum of index * length, mm
};

// Sequential trace: reflects until the ray is absorbed, leaves the scene, or has met `most_hits` faces.
Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits = 64);

}  // namespace stepdiag
