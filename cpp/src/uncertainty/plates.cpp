#include "uncertainty/plates.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "uncertainty/beam_paths.hpp"

namespace stepdiag {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

FaceFrame Unfolding::of(const FaceFrame& frame) const {
    const Eigen::Map<const RowMajor> face_R_scene(frame.rotation.data());
    FaceFrame unfolded;
    RowMajor::Map(unfolded.rotation.data()) = face_R_scene * rotation;
    Eigen::Vector3d::Map(unfolded.translation.data()) =
        face_R_scene * shift + Eigen::Vector3d::Map(frame.translation.data());
    return unfolded;
}

Placement Unfolding::of(const Placement& placement) const {
    return {rotation.transpose() * (placement.position - shift), rotation.transpose() * placement.rotation};
}

void Unfolding::reflect(const FaceFrame& frame) {
    const Eigen::Vector3d normal(frame.rotation[6], frame.rotation[7], frame.rotation[8]);
    shift -= 2.0 * (normal.dot(shift) + frame.translation[2]) * normal;
    rotation -= 2.0 * normal * (normal.transpose() * rotation);
}

namespace {

constexpr double parallel = 1e-14;  // sine; what rounding leaves of a right angle
constexpr double rounding = 1e-9;   // mm, of the corners
constexpr double to_spare = 1e-3;   // mm, between light and the edge of a face

Eigen::AlignedBox3d box_of(const FaceFrame& frame, const Outline& outline) {
    const Eigen::Map<const RowMajor> face_R_scene(frame.rotation.data());
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector2d& corner : outline.corners)
        box.extend(face_R_scene.transpose() *
                   (Eigen::Vector3d(corner[0], corner[1], 0.0) - Eigen::Vector3d::Map(frame.translation.data())));
    return box;
}

// Whether the face is a rectangle with sides along x and y, seen along z.
bool is_upright(const FaceFrame& frame, const Outline& outline, const Eigen::AlignedBox3d& box) {
    const double area = 4.0 * outline.half_size.prod() * std::abs(frame.rotation[8]);
    return outline.is_centred_rectangle && std::abs(box.sizes().head<2>().prod() - area) <= 1e-9 * area;
}

void add(double index, double thickness, std::vector<Plates::Glass>& glasses) {
    const auto same =
        std::find_if(glasses.begin(), glasses.end(), [&](const Plates::Glass& glass) { return glass.index == index; });
    if (same != glasses.end()) same->thickness += thickness;
    else glasses.push_back({index, thickness});
}

}  // namespace

std::optional<Plates> plates_of(const BeamPath& path, const std::vector<bool>& moves, double gap) {
    Plates plates{};
    Unfolding unfolding;
    std::vector<Plates::Glass> glasses;
    Eigen::AlignedBox2d inside;
    double z = 0.0, lowest = 0.0;  // of the last parallel face, and of the others since
    for (std::size_t e = path.mirror_at + 1; e < path.route.encounters.size(); ++e) {
        const RecordedEncounter& met = path.route.encounters[e];
        const std::size_t face = std::size_t(met.face);
        const FaceFrame frame = unfolding.of(path.frames[face]);
        const Eigen::AlignedBox3d box = box_of(frame, path.outlines[face]);
        const bool first = e == path.mirror_at + 1;
        if (moves[std::size_t(path.component[face])] || !is_upright(frame, path.outlines[face], box)) break;
        const Eigen::AlignedBox2d seen(box.min().head<2>(), box.max().head<2>());
        inside = first ? seen : inside.intersection(seen);
        const bool passes = met.event == Event::refracted && met.index_before == met.index_after;
        if ((met.event == Event::reflected || passes) && !first && box.max().z() <= z + rounding) {
            lowest = std::min(lowest, box.min().z());
            if (!passes) unfolding.reflect(path.frames[face]);
            continue;
        }
        const bool is_parallel = std::max(std::abs(frame.rotation[6]), std::abs(frame.rotation[7])) <= parallel;
        const double here = -frame.translation[2] * frame.rotation[8];
        if (!is_parallel || (met.event != Event::refracted && met.event != Event::absorbed)) break;
        if (first) plates.first = here;
        else if (here >= z - gap || lowest < here - rounding) break;
        if (met.index_before != path.air_index) add(met.index_before, z - here, glasses);
        z = lowest = here;
        if ((met.event == Event::absorbed ? met.index_before : met.index_after) != path.air_index) continue;
        plates.last = here;
        plates.glasses = glasses;
        plates.centre = inside.center();
        plates.half_size = 0.5 * inside.sizes() - Eigen::Vector2d::Constant(to_spare);
        plates.faces = e - path.mirror_at;
        plates.unfolding = unfolding;
    }
    return plates.faces > 0 ? std::optional(plates) : std::nullopt;
}

}  // namespace stepdiag
