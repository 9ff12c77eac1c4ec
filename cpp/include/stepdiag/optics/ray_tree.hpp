// Non-sequential tracing. A splitting face transmits and reflects each ray, so one beam becomes a tree of segments.
// Powers are shares of the source's power. The absorbed power, the power that leaves the scene and the power cut by the
// limits add up to 1.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

struct TreeLimits {
    int most_hits = 64;          // on any path from the source
    double least_power = 1e-6;   // share of the source's power; weaker light is cut
    int most_segments = 100000;  // in the whole tree
};

enum class SegmentEnd {
    goes_on,   // other segments start at its end
    absorbed,  // absorbed by the face that it meets
    left,      // left the scene without meeting a face
    cut,       // cut by a limit before it was traced
};

struct Segment {
    int parent;                  // index of the preceding segment; -1 for the first segment
    Ray ray;                     // origin and direction of the segment
    double index;                // refractive index of its medium
    double power;                // share of the source's power at its start
    std::optional<Hit> hit;      // the face at its end; empty if it leaves the scene
    std::optional<Event> event;  // event at the hit of its parent; empty for the first segment
    SegmentEnd end;
};

struct RayTree {
    std::vector<Segment> segments;  // a parent precedes its children
    double absorbed = 0.0;          // power absorbed by absorbing, reflecting and splitting faces
    double left = 0.0;
    double cut = 0.0;

    // Indices of the segments absorbed at this face, strongest first.
    std::vector<int> arrivals(int face) const;
    // The path from the source to the end of a segment. Throws InvalidArgument for an index out of range, and for a
    // segment that goes on, because its path ends with another segment.
    Path path_to(int segment) const;
};

// Traces a source of power 1 in the ambient medium. The strongest branches come first, so that the limit on segments
// cuts the weakest ones. Throws InvalidArgument for a limit below 1 or a least power outside 0 to 1.
RayTree trace_tree(const Scene& scene, const Medium& ambient, const Ray& ray, const TreeLimits& limits = {});

}  // namespace stepdiag
