// Replay of a recorded path: many rays along one known sequence of faces, in double, several lanes at once.
//   plane:  t = -(R_z.o + t_z)/(R_z.d),  o <- o + t d;  then reflection, Snell's law, or straight on
// A face is given as a rigid frame (face_R_scene, face_t_scene: local = R x + t, the face in the plane local z = 0,
// its normal along local z) and an outline in local x-y that does not change. Every number may vary from lane to lane
// or be the same for all. Each lane checks at every face that it goes forward, stays inside the outline, refracts or is
// totally reflected as recorded, and is not NaN. That no other face came into the way is what a replay cannot see: a
// fraction of all lanes is traced again for that (head/traced_head.hpp).
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

// A number for each lane (stride 1), or one for all lanes (stride 0).
struct LaneValue {
    const double* value;
    std::ptrdiff_t stride = 0;
};

// The rigid frame of a face: local = rotation x + translation.
struct FaceFrame {
    std::array<double, 9> rotation;     // face_R_scene, row by row: local x, y, normal
    std::array<double, 3> translation;  // mm
};

// A convex outline in the face's own x-y plane, mm. Rectangles centred on the frame's origin are the fast case.
struct Outline {
    std::vector<Eigen::Vector2d> corners;
    bool is_centred_rectangle;
    Eigen::Vector2d half_size;                 // of a centred rectangle
    std::vector<std::array<double, 3>> edges;  // others: inside where a x + b y <= c for every edge (a, b, c)
};

FaceFrame frame_of(const Face& face);  // origin: the middle of the outline's bounding box along its first edge
Outline outline_of(const Face& face, const FaceFrame& frame);

// One face on the way.
struct Encounter {
    Event event;
    bool deflects = true;  // refracted: false where the medium is the same on both sides; `index_after` is not read
    std::array<LaneValue, 9> rotation;
    std::array<LaneValue, 3> translation;
    const Outline* outline;
    LaneValue index_before, index_after;  // refracted, totally_reflected: both; others: before
};

// Rays at their start (input), and where they end (output; never null). Lengths are added to. Results may be written
// over the very arrays that the rays came from, so that one route goes on where another ended.
struct LaneRays {
    std::array<LaneValue, 3> origin, direction;
    LaneValue optical_length;  // sum of n t, mm
    LaneValue reduced_length;  // sum of t / n, mm
};
struct LaneResults {
    std::array<double*, 3> point, direction;
    double* optical_length;
    double* reduced_length;
    std::uint8_t* followed;  // 1 where every check was passed; the other results of a lane with 0 mean nothing
};

// `gap`: hits nearer than this do not count as forward (Scene::self_intersection_gap). A lane's result does not depend
// on how many lanes there are, on its place among them, nor on which values vary.
void replay(const std::vector<Encounter>& route, const LaneRays& rays, std::size_t lanes, double gap,
            const LaneResults& results);

}  // namespace stepdiag
