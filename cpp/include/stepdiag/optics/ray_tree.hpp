// Non-sequential tracing: a splitting face sends a ray both ways, so that one beam becomes a tree of segments.
// Powers are shares of the source's. What is absorbed, what leaves the scene and what the limits cut add up to it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

struct TreeLimits {
    int most_hits = 64;          // of any path from the source
    double least_power = 1e-6;   // of the source's power; weaker light is cut
    int most_segments = 100000;  // of the whole tree
};

enum class SegmentEnd {
    goes_on,   // other segments start where it ends
    absorbed,  // by the face it meets
    left,      // the scene, without meeting a face
    cut,       // by a limit, before it was followed
};

struct Segment {
    int parent;                  // index of the segment that it comes from; -1: the source
    Ray ray;                     // where it starts
    double index;                // of the medium it runs in
    double power;                // share of the source's power, at its start
    std::optional<Hit> hit;      // where it meets a face
    std::optional<Event> event;  // how it came out of its parent's hit; none for the source
    SegmentEnd end;
};

struct RayTree {
    std::vector<Segment> segments;  // a parent stands before its children
    double absorbed = 0.0;          // power lost in faces: absorbing ones, and shares of reflecting and splitting ones
    double left = 0.0;
    double cut = 0.0;

    // Segments absorbed at this face, strongest first.
    std::vector<int> arrivals(int face) const;
    // The way from the source to the end of a segment. Throws InvalidArgument for one that goes on: its way ends with
    // another one.
    Path path_to(int segment) const;
};

// A source of power 1 in the ambient medium. The strongest branches are followed first, so that a limit on the number
// of segments cuts the weakest. Throws InvalidArgument for limits that make no sense.
RayTree trace_tree(const Scene& scene, const Medium& ambient, const Ray& ray, const TreeLimits& limits = {});

}  // namespace stepdiag
