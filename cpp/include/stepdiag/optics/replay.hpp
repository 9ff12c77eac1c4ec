// Replay of a recorded path: traces many rays along one known sequence of faces, in double precision and with SIMD.
// Each SIMD lane is one ray.
//   plane:  t = -(R_z.o + t_z)/(R_z.d),  o <- o + t d;  then reflection, Snell's law, or no deflection
// A face has a rigid frame (face_R_scene, face_t_scene: local = R x + t; the face is in the plane local z = 0, its
// normal along local z) and a fixed outline in local x-y. Every number may differ between lanes or be common to all.
// At every face, each lane checks that the ray goes forward, meets the face inside the outline, is refracted or totally
// reflected as recorded, and has no NaN. A replay cannot detect another face in the path. For this reason a share of
// all lanes is traced again (head/traced_head.hpp).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/path.hpp"

namespace stepdiag {

// One number for each lane (stride 1), or one number for all lanes (stride 0).
struct LaneValue {
    const double* value;
    std::ptrdiff_t stride = 0;
};

// The rigid frame of a face: local = rotation x + translation.
struct FaceFrame {
    std::array<double, 9> rotation;     // face_R_scene in row-major order; rows are local x, y and the normal
    std::array<double, 3> translation;  // mm
};

// A convex outline in the face's own x-y plane, mm. Rectangles centred on the frame's origin have a faster test.
struct Outline {
    std::vector<Eigen::Vector2d> corners;
    bool is_centred_rectangle;
    Eigen::Vector2d half_size;                 // for a centred rectangle
    std::vector<std::array<double, 3>> edges;  // for other outlines: a x + b y <= c inside, for every edge (a, b, c)
};

// The origin is the centre of the outline's bounding box, whose sides are parallel and perpendicular to the first edge.
FaceFrame frame_of(const Face& face);
Outline outline_of(const Face& face, const FaceFrame& frame);

// One face on the path.
struct Encounter {
    Event event;
    bool deflects = true;  // refracted: false if the media on both sides are equal; `index_after` is not read then
    std::array<LaneValue, 9> rotation;
    std::array<LaneValue, 3> translation;
    const Outline* outline;
    LaneValue index_before, index_after;  // refracted, totally_reflected: both are read; otherwise only index_before
};

// Rays at the start of a route (input), and at its end (output; pointers must not be null). The lengths of the route
// are added to the initial lengths. Outputs may be the input arrays, so that one route can continue another.
struct LaneRays {
    std::array<LaneValue, 3> origin, direction;
    LaneValue optical_length;  // sum of n t, mm
    LaneValue reduced_length;  // sum of t / n, mm
};
struct LaneResults {
    std::array<double*, 3> point, direction;
    double* optical_length;
    double* reduced_length;
    std::uint8_t* followed;  // 1 if the lane passed every check; its other results are undefined if 0
};

// `gap`, mm: closer hits do not count as forward (Scene::self_intersection_gap). The result of a lane does not depend
// on the number of lanes, on its index, or on which values vary.
void replay(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
            const LaneResults& results);

}  // namespace stepdiag
