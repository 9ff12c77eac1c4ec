// Path of one ray through a scene: the faces that it meets, in order (sequential trace).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

enum class PathEnd {
    absorbed,
    missed,         // left the scene
    too_many_hits,  // stopped by the limit on hits
};

// What happened to the light at a face.
enum class Event { reflected, refracted, totally_reflected, absorbed };

struct Path {
    std::vector<Hit> hits;
    std::vector<Event> events;  // one for each hit
    Eigen::Vector3d direction;  // of the last segment
    PathEnd end;
    double geometric_length;  // from the origin to the last hit, mm
    double optical_length;    // sum of index * length, mm
    double reduced_length;    // sum of length / index, mm; determines the radius of a Gaussian beam
};

// Traces a ray until it is absorbed, leaves the scene, or has met `most_hits` faces. The ray starts in the ambient
// medium. A refracting face refracts or totally reflects all light. A splitting face acts like a refracting one here;
// trace_tree (ray_tree.hpp) also follows the reflected branch.
Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits = 64);

}  // namespace stepdiag
