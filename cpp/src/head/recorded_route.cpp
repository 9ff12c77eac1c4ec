#include "head/recorded_route.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "optics/separation.hpp"

namespace stepdiag {
namespace {

// The twelve numbers of the mirror's frame (columns) for each pose (rows).
Eigen::Matrix<double, Eigen::Dynamic, 12> mirror_frames(const std::vector<MirrorPose>& mirrors) {
    Eigen::Matrix<double, Eigen::Dynamic, 12> frames(mirrors.size(), 12);
    for (std::size_t i = 0; i < mirrors.size(); ++i) {
        const Eigen::Matrix3d face_R_scene = mirrors[i].rotation.transpose();
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) frames(Eigen::Index(i), 3 * r + c) = face_R_scene(r, c);
        frames.row(Eigen::Index(i)).tail<3>() = -face_R_scene * mirrors[i].point;
    }
    return frames;
}

}  // namespace

RecordedRoute record_route(const RayTree& tree, int segment) {
    RecordedRoute route{{}, tree.segments[segment].power};
    Event event = Event::absorbed;
    double index_after = tree.segments[segment].index;
    for (int s = segment; s >= 0; s = tree.segments[s].parent) {
        const Segment& here = tree.segments[s];
        route.encounters.push_back({here.hit->face, event, here.index, index_after});
        if (here.event) event = *here.event;
        index_after = here.index;
    }
    std::reverse(route.encounters.begin(), route.encounters.end());
    return route;
}

std::vector<Segment> path_segments(const RayTree& tree, int segment) {
    std::vector<Segment> path;
    for (int s = segment; s >= 0; s = tree.segments[s].parent) path.push_back(tree.segments[s]);
    std::reverse(path.begin(), path.end());
    return path;
}

namespace {

// Motion of a segment perpendicular to itself. A mirror that moves along the beam does not change the segment's line.
double sideways(const Segment& from, const Segment& to) {
    const auto across = [&](const Eigen::Vector3d& way) { return way.cross(from.ray.direction).norm(); };
    return std::max(across(to.ray.origin - from.ray.origin), across(to.hit->point - from.hit->point));
}

}  // namespace

bool pass_clear(const std::vector<std::vector<Segment>>& paths, const Scene& fixed, const std::vector<int>& component,
                int source, double times) {
    const std::vector<Face>& faces = fixed.faces();
    std::vector<Eigen::AlignedBox3d> boxes(faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (const auto& corner : faces[f].outline) boxes[f].extend(corner);

    const auto component_of = [&](int face) {
        return face < int(faces.size()) ? component[face] : -1;
    };  // mirror: none
    for (std::size_t k = 0; k < paths.front().size(); ++k) {
        const int to = component_of(paths.front()[k].hit->face);
        const int from = k > 0 ? component_of(paths.front()[k - 1].hit->face) : source;
        double moved = 0.0;
        for (const auto& path : paths) moved = std::max(moved, sideways(paths[0][k], path[k]));
        const double clearance = 1.0 + times * moved;
        for (const auto& path : paths) {
            const Eigen::Vector3d &start = path[k].ray.origin, &end = path[k].hit->point;
            Eigen::AlignedBox3d around(start.cwiseMin(end), start.cwiseMax(end));
            const std::vector<Face> line{{start, Eigen::Vector3d::UnitZ(), {start, end}, Surface::absorbing}};
            for (std::size_t f = 0; f < faces.size(); ++f) {
                if (component[f] == to || component[f] == from || boxes[f].exteriorDistance(around) >= clearance)
                    continue;
                if (separation(line, {faces[f]}) < clearance) return false;
            }
        }
    }
    return true;
}

bool same_faces(const RecordedRoute& a, const RecordedRoute& b) {
    const auto same = [](const RecordedEncounter& x, const RecordedEncounter& y) {
        return x.face == y.face && x.event == y.event;
    };
    return std::equal(a.encounters.begin(), a.encounters.end(), b.encounters.begin(), b.encounters.end(), same);
}

bool same_faces(const std::vector<RecordedRoute>& a, const std::vector<RecordedRoute>& b) {
    const auto same = [](const RecordedRoute& x, const RecordedRoute& y) { return same_faces(x, y); };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

RouteReplay replay_route(const RecordedRoute& route, const std::vector<FaceFrame>& frames,
                         const std::vector<Outline>& outlines, const Ray& source,
                         const std::vector<MirrorPose>& mirrors, double gap) {
    const int mirror = int(frames.size());
    const auto poses = mirror_frames(mirrors);
    std::vector<Encounter> encounters;
    for (const RecordedEncounter& recorded : route.encounters) {
        Encounter& met = encounters.emplace_back();
        met.event = recorded.event;
        met.deflects = recorded.index_before != recorded.index_after;
        met.outline = &outlines[recorded.face];
        for (int k = 0; k < 12; ++k) {
            LaneValue& value = k < 9 ? met.rotation[k] : met.translation[k - 9];
            if (recorded.face == mirror) value = {poses.col(k).data(), 1};
            else value = {k < 9 ? &frames[recorded.face].rotation[k] : &frames[recorded.face].translation[k - 9], 0};
        }
        met.index_before = {&recorded.index_before, 0};
        met.index_after = {&recorded.index_after, 0};
    }

    // The path from the source to the mirror is the same for all poses.
    const auto meets_mirror = [mirror](const RecordedEncounter& met) { return met.face == mirror; };
    const auto way_out =
        std::find_if(route.encounters.begin(), route.encounters.end(), meets_mirror) - route.encounters.begin();
    Eigen::Vector3d origin = source.origin, direction = source.direction;
    double optical_length = 0.0, reduced_length = 0.0;
    std::uint8_t out = 1;
    const auto rays = [&]() -> LaneRays {
        return {{{{&origin[0]}, {&origin[1]}, {&origin[2]}}},
                {{{&direction[0]}, {&direction[1]}, {&direction[2]}}},
                {&optical_length},
                {&reduced_length}};
    };
    const auto middle = encounters.begin() + way_out;
    if (way_out > 0)
        replay({encounters.begin(), middle}, rays(), 1, gap,
               {{&origin[0], &origin[1], &origin[2]},
                {&direction[0], &direction[1], &direction[2]},
                &optical_length,
                &reduced_length,
                &out});

    const std::size_t n = mirrors.size();
    RouteReplay result;
    result.points.resize(Eigen::Index(n), 3);
    result.directions.resize(Eigen::Index(n), 3);
    result.optical_length.resize(n);
    result.reduced_length.resize(n);
    result.followed.assign(n, 0);
    if (!out) return result;
    replay({middle, encounters.end()}, rays(), n, gap,
           {{result.points.col(0).data(), result.points.col(1).data(), result.points.col(2).data()},
            {result.directions.col(0).data(), result.directions.col(1).data(), result.directions.col(2).data()},
            result.optical_length.data(),
            result.reduced_length.data(),
            result.followed.data()});
    return result;
}

}  // namespace stepdiag
