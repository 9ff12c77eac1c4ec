#include "stepdiag/optics/body.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

using Corners = std::vector<Eigen::Vector3d>;

void require_positive(double value, const char* name) {
    if (!(std::isfinite(value) && value > 0.0))
        throw InvalidArgument(std::string(name) + ": expected a positive length");
}

void require_closed(const std::vector<std::vector<int>>& faces) {
    std::map<std::pair<int, int>, int> joined;
    for (const auto& face : faces)
        for (std::size_t k = 0; k < face.size(); ++k) ++joined[std::minmax(face[k], face[(k + 1) % face.size()])];
    for (const auto& [edge, count] : joined)
        if (count != 2)
            throw InvalidArgument("body: not closed: the edge between corners " + std::to_string(edge.first) + " and " +
                                  std::to_string(edge.second) + " belongs to " + std::to_string(count) +
                                  " face(s), expected 2");
}

// The face of a convex body through these corners, with its normal outward.
Face make_outer_face(const Corners& corners, const std::vector<int>& face, const std::string& name, double tolerance) {
    Face made{corners[face[0]], Eigen::Vector3d::Zero(), {}, Surface::refracting, {}};
    for (const int corner : face) made.outline.push_back(corners[corner]);
    for (std::size_t k = 2; k < made.outline.size(); ++k)
        made.normal += (made.outline[k - 1] - made.point).cross(made.outline[k] - made.point);
    if (!(made.normal.norm() > tolerance * tolerance)) throw InvalidArgument(name + ": has no area");
    made.normal.normalize();

    double highest = 0.0, lowest = 0.0;
    for (const auto& corner : corners) {
        const double height = (corner - made.point).dot(made.normal);
        highest = std::max(highest, height);
        lowest = std::min(lowest, height);
    }
    for (const auto& corner : made.outline)
        if (!(std::abs((corner - made.point).dot(made.normal)) <= tolerance))
            throw InvalidArgument(name + ": is not planar");
    if (highest > tolerance && lowest < -tolerance)
        throw InvalidArgument("body: not convex: corners on both sides of " + name);
    if (highest > tolerance) made.normal = -made.normal;
    return made;
}

}  // namespace

Face make_rectangle(const Eigen::Vector3d& centre, const Eigen::Matrix3d& scene_R_face, const Eigen::Vector2d& size,
                    Surface surface) {
    const Eigen::Vector3d x = 0.5 * size.x() * scene_R_face.col(0);
    const Eigen::Vector3d y = 0.5 * size.y() * scene_R_face.col(1);
    return {centre, scene_R_face.col(2), {centre - x - y, centre + x - y, centre + x + y, centre - x + y}, surface, {}};
}

std::vector<Face> placed(std::vector<Face> faces, const Placement& placement) {
    const auto place = [&](Eigen::Vector3d& point) { point = placement.position + placement.rotation * point; };
    for (Face& face : faces) {
        place(face.point);
        face.normal = placement.rotation * face.normal;
        for (auto& corner : face.outline) place(corner);
    }
    return faces;
}

std::vector<Face> make_body(const Corners& corners, const std::vector<std::vector<int>>& faces, Medium glass,
                            const Placement& placement) {
    if (faces.size() < 4)
        throw InvalidArgument("body: expected four faces or more, got " + std::to_string(faces.size()));
    if (faces.size() > std::size_t(most_faces_of_a_body)) {
        const double share = double(faces.size()) / most_faces_of_a_body;
        throw InvalidArgument("body: expected at most " + std::to_string(most_faces_of_a_body) + " faces, got " +
                              std::to_string(faces.size()) +
                              "; the check of each face against every corner would take about " +
                              std::to_string(std::lround(0.6 * share * share)) + " s; divide it into several bodies");
    }
    if (!(std::isfinite(glass.index) && glass.index >= 1.0))
        throw InvalidArgument("body: expected an index of at least 1");
    Corners placed;
    for (const auto& corner : corners) {
        placed.push_back(placement.position + placement.rotation * corner);
        if (!placed.back().allFinite()) throw InvalidArgument("body: expected finite corners");
    }
    for (std::size_t f = 0; f < faces.size(); ++f) {
        if (faces[f].size() < 3)
            throw InvalidArgument("body: face " + std::to_string(f) + ": expected three corners or more");
        for (const int corner : faces[f])
            if (corner < 0 || corner >= int(corners.size()))
                throw InvalidArgument("body: face " + std::to_string(f) + ": there is no corner " +
                                      std::to_string(corner));
    }
    require_closed(faces);

    double size = 0.0;
    for (const auto& corner : placed) size = std::max(size, (corner - placed.front()).norm());
    std::vector<Face> body;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        body.push_back(make_outer_face(placed, faces[f], "body: face " + std::to_string(f), 1e-9 * size));
        body.back().behind = glass;
    }
    return body;
}

std::vector<Face> make_plate(double width, double height, double thickness, Medium glass, const Placement& placement) {
    return make_wedge(width, height, thickness, 0.0, glass, placement);
}

std::vector<Face> make_wedge(double width, double height, double thickness, double angle, Medium glass,
                             const Placement& placement) {
    require_positive(width, "width");
    require_positive(height, "height");
    require_positive(thickness, "thickness");
    const double x = 0.5 * width, y = 0.5 * height, z = 0.5 * thickness;
    const double rise = x * std::tan(angle);
    if (!(std::abs(rise) < thickness))
        throw InvalidArgument("wedge angle: too large: the faces would meet inside the width");
    return make_body({{-x, -y, -z},
                      {x, -y, -z},
                      {x, y, -z},
                      {-x, y, -z},
                      {-x, -y, z - rise},
                      {x, -y, z + rise},
                      {x, y, z + rise},
                      {-x, y, z - rise}},
                     {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}, glass,
                     placement);
}

std::vector<Face> make_prism(double side, double height, double apex, Medium glass, const Placement& placement) {
    require_positive(side, "side");
    require_positive(height, "height");
    if (!(apex > 0.0 && apex < pi)) throw InvalidArgument("prism apex: expected an angle between 0 and pi");
    const double x = side * std::sin(0.5 * apex), y = 0.5 * height, z = side * std::cos(0.5 * apex);
    return make_body({{-x, -y, 0}, {x, -y, 0}, {0, -y, z}, {-x, y, 0}, {x, y, 0}, {0, y, z}},
                     {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}, {0, 1, 2}, {3, 4, 5}}, glass, placement);
}

std::vector<Face> make_corner_cube(double depth, Medium glass, const Placement& placement) {
    require_positive(depth, "depth");
    // The edges of the cube are inclined by acos(1/sqrt 3) to z. At z = depth they are sqrt(2) depth from the axis.
    const double radius = std::sqrt(2.0) * depth;
    Corners corners{Eigen::Vector3d::Zero()};
    for (int k = 0; k < 3; ++k) {
        const double angle = 2.0 * pi * k / 3.0;
        corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle), depth);
    }
    return make_body(corners, {{1, 2, 3}, {0, 1, 2}, {0, 2, 3}, {0, 3, 1}}, glass, placement);
}

std::vector<Face> make_cube_splitter(double edge, Medium glass, double reflectance, double absorptance,
                                     const Placement& placement) {
    require_positive(edge, "edge");
    if (!(reflectance >= 0.0 && absorptance >= 0.0 && reflectance + absorptance <= 1.0 + 1e-12))
        throw InvalidArgument("splitter: expected reflectance and absorptance of 0 to 1, together at most 1");
    std::vector<Face> cube = make_plate(edge, edge, edge, glass);
    const double root = std::sqrt(0.5), length = (1.0 - 2e-4) * edge;
    Eigen::Matrix3d diagonal;  // local y is the cube's y; the normal is between +x and -z
    diagonal << -root, 0.0, root, 0.0, 1.0, 0.0, -root, 0.0, -root;
    Face face = make_rectangle(Eigen::Vector3d::Zero(), diagonal, {length / root, length}, Surface::splitting);
    face.before = face.behind = glass;
    face.reflectance = reflectance;
    face.absorptance = absorptance;
    cube.push_back(face);
    return placed(std::move(cube), placement);
}

std::vector<Face> make_mirror(double width, double height, double reflectance, const Placement& placement) {
    require_positive(width, "width");
    require_positive(height, "height");
    if (!(reflectance >= 0.0 && reflectance <= 1.0)) throw InvalidArgument("mirror: expected a reflectance of 0 to 1");
    Face face = make_rectangle(placement.position, placement.rotation, {width, height}, Surface::reflecting);
    face.reflectance = reflectance;
    return {face};
}

std::vector<Face> make_screen(double width, double height, const Placement& placement) {
    require_positive(width, "width");
    require_positive(height, "height");
    return {make_rectangle(placement.position, placement.rotation, {width, height}, Surface::absorbing)};
}

}  // namespace stepdiag
