// The path of a beam as one pose's trace found it, and its replay for the other poses.
#pragma once

#include <cstdint>
#include <vector>

#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

RecordedRoute record_route(const RayTree& tree, int segment);
bool same_faces(const RecordedRoute& a, const RecordedRoute& b);
bool same_faces(const std::vector<RecordedRoute>& a, const std::vector<RecordedRoute>& b);

// A path as its segments, source first.
std::vector<Segment> path_segments(const RayTree& tree, int segment);
// Whether nothing else comes near any of these paths of one beam (all with the same faces, at several poses), which a
// replay could not see: no face is nearer to a segment than `times` what the segment moves from pose to pose, and a
// millimetre. `component`: of each face; `source`: the beam's. The components that a segment starts from and ends at do
// not count: a body is convex, so that light which leaves it does not meet it again.
bool pass_clear(const std::vector<std::vector<Segment>>& paths, const Scene& fixed, const std::vector<int>& component,
                int source, double times = 2.0);

// A column for each coordinate, a row for each pose.
struct RouteReplay {
    Eigen::Matrix<double, Eigen::Dynamic, 3> points, directions;
    std::vector<double> optical_length, reduced_length;
    std::vector<std::uint8_t> followed;

    Eigen::Vector3d point(std::size_t i) const { return points.row(Eigen::Index(i)); }
    Eigen::Vector3d direction(std::size_t i) const { return directions.row(Eigen::Index(i)); }
};

// Frames and outlines of the head's faces; the mirror's face is the last outline, its frames follow from its poses.
RouteReplay replay_route(const RecordedRoute& route, const std::vector<FaceFrame>& frames,
                         const std::vector<Outline>& outlines, const Ray& source,
                         const std::vector<MirrorPose>& mirrors, double gap);

}  // namespace stepdiag
