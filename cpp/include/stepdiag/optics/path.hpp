// The way of one ray through a scene.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

enum class PathEnd {
    absorbed,
    missed,         // left the scene
    too_many_hits,  // cut by a limit
};

// What happened to the light where it met a face.
enum class Event { reflected, refracted, totally_reflected, absorbed };

struct Path {
    std::vector<Hit> hits;
    std::vector<Event> events;  // one a hit
    Eigen::Vector3d direction;  // of the last segment
    PathEnd end;
    double geometric_length;  // from the origin to the last hit, mm
    double optical_length;    // sum of index * length, mm
    double reduced_length;    // sum of length / index, mm: what a Gaussian beam's radius follows
};

// Sequential trace: reflects and refracts until the ray is absorbed, leaves the scene, or has met `most_hits` faces. It
// starts in the ambient medium. At a refracting face all light goes on, refracted or else totally reflected. At a
// splitting face it goes on as at a refracting one; its other way is trace_tree's (ray_tree.hpp).
Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits = 64);

}  // namespace stepdiag
