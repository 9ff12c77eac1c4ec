#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "stepdiag/optics/replay.hpp"

namespace stepdiag {
namespace {

// Coordinates of the corners along two axes, relative to an origin.
std::vector<Eigen::Vector2d> project(const Face& face, const Eigen::Vector3d& origin, const Eigen::Vector3d& x,
                                     const Eigen::Vector3d& y) {
    std::vector<Eigen::Vector2d> projected;
    for (const auto& corner : face.outline) projected.emplace_back(x.dot(corner - origin), y.dot(corner - origin));
    return projected;
}

}  // namespace

FaceFrame frame_of(const Face& face) {
    const Eigen::Vector3d edge = face.outline[1] - face.outline[0];
    const Eigen::Vector3d x = (edge - edge.dot(face.normal) * face.normal).normalized();
    const Eigen::Vector3d y = face.normal.cross(x);
    Eigen::Vector2d lowest(0.0, 0.0), highest(0.0, 0.0);
    const auto corners = project(face, face.outline[0], x, y);
    for (const auto& corner : corners) lowest = lowest.cwiseMin(corner), highest = highest.cwiseMax(corner);
    const Eigen::Vector2d middle = 0.5 * (lowest + highest);
    const Eigen::Vector3d origin = face.outline[0] + middle.x() * x + middle.y() * y;
    const Eigen::Vector3d& z = face.normal;  // use the plane's own point below, because corners are rounded
    return {{x.x(), x.y(), x.z(), y.x(), y.y(), y.z(), z.x(), z.y(), z.z()},
            {-x.dot(origin), -y.dot(origin), -z.dot(face.point)}};
}

Outline outline_of(const Face& face, const FaceFrame& frame) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(frame.rotation.data());
    const Eigen::Map<const Eigen::Vector3d> translation(frame.translation.data());
    Outline outline{{}, false, Eigen::Vector2d::Zero(), {}};
    for (const auto& corner : face.outline) outline.corners.push_back((rotation * corner + translation).head<2>());

    const std::size_t n = outline.corners.size();
    double area = 0.0;  // twice the area; the sign gives the orientation of the outline
    for (const auto& corner : outline.corners) outline.half_size = outline.half_size.cwiseMax(corner.cwiseAbs());
    for (std::size_t k = 0; k < n; ++k) {
        const Eigen::Vector2d &a = outline.corners[k], &b = outline.corners[(k + 1) % n];
        area += a.x() * b.y() - a.y() * b.x();
    }
    // Rounding moves the corners of a rectangle by about 1e-13 mm in a scene of several metres.
    const double tolerance = 1e-12 * (outline.half_size.norm() + translation.norm());
    const auto is_corner = [&](const Eigen::Vector2d& corner) {
        return (corner.cwiseAbs() - outline.half_size).cwiseAbs().maxCoeff() <= tolerance;
    };
    outline.is_centred_rectangle = n == 4 && std::all_of(outline.corners.begin(), outline.corners.end(), is_corner);
    if (outline.is_centred_rectangle) return outline;

    for (std::size_t k = 0; k < n; ++k) {
        const Eigen::Vector2d& from = outline.corners[k];
        const Eigen::Vector2d along = (outline.corners[(k + 1) % n] - from).normalized();
        const Eigen::Vector2d outward =
            area > 0.0 ? Eigen::Vector2d(along.y(), -along.x()) : Eigen::Vector2d(-along.y(), along.x());
        outline.edges.push_back({outward.x(), outward.y(), outward.dot(from)});
    }
    return outline;
}

}  // namespace stepdiag
