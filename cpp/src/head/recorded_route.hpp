// Path of a beam from the trace of one pose, and its replay for other poses.
#pragma once

#include <cstdint>
#include <vector>

#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

RecordedRoute record_route(const RayTree& tree, int segment);
bool same_faces(const RecordedRoute& a, const RecordedRoute& b);
bool same_faces(const std::vector<RecordedRoute>& a, const std::vector<RecordedRoute>& b);

// Segments of a path, starting at the source.
std::vector<Segment> path_segments(const RayTree& tree, int segment);
// Whether no other face is near the paths of one beam, because a replay cannot detect such a face. `paths`: for several
// poses, all with the same faces. The distance of every face from a segment must be more than 1 mm plus `times` the
// motion of the segment between the poses. `component`: of each face; `source`: component of the beam. The components
// at the ends of a segment are excluded: bodies are convex, so light that leaves a body does not meet it again.
bool pass_clear(const std::vector<std::vector<Segment>>& paths, const Scene& fixed, const std::vector<int>& component,
                int source, double times = 2.0);

// Results of a replay: one column for each coordinate, one row for each pose.
struct RouteReplay {
    Eigen::Matrix<double, Eigen::Dynamic, 3> points, directions;
    std::vector<double> optical_length, reduced_length;
    std::vector<std::uint8_t> followed;

    Eigen::Vector3d point(std::size_t i) const { return points.row(Eigen::Index(i)); }
    Eigen::Vector3d direction(std::size_t i) const { return directions.row(Eigen::Index(i)); }
};

// `frames`, `outlines`: of the head's faces. The mirror has the last outline; its frames follow from its poses.
RouteReplay replay_route(const RecordedRoute& route, const std::vector<FaceFrame>& frames,
                         const std::vector<Outline>& outlines, const Ray& source,
                         const std::vector<MirrorPose>& mirrors, double gap);

}  // namespace stepdiag
