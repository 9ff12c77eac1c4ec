// Flat faces with an outline, and bodies of glass made of them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/surface.hpp"

namespace stepdiag {

// A convex polygon in a plane. The plane is kept in double beside the outline, because it decides where a ray meets the
// face; planes rebuilt from single-precision vertices would be off by tenths of a micrometre.
struct Face {
    Eigen::Vector3d point;                 // of the plane, mm
    Eigen::Vector3d normal;                // unit; of a body: outward
    std::vector<Eigen::Vector3d> outline;  // three or more corners in order, mm
    Surface surface;
    Medium behind = {};                 // refracting, splitting: what the normal points away from
    std::optional<Medium> before = {};  // and what it points into; none: the ambient medium
    double reflectance = 1.0;           // reflecting, splitting: share of the power, 0 to 1
    double absorptance = 0.0;           // splitting: share lost, the rest goes on
};

// A rectangle in the local x-y plane of `scene_R_face`, centred at `centre`, normal along local z.
Face make_rectangle(const Eigen::Vector3d& centre, const Eigen::Matrix3d& scene_R_face, const Eigen::Vector2d& size,
                    Surface surface);

// Where a body stands in the scene.
struct Placement {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();      // of the body's origin, mm
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // scene_R_body
};

// Faces of a body that stands with its origin and axes in those of the scene, put into their place.
std::vector<Face> placed(std::vector<Face> faces, const Placement& placement);

// A convex polyhedron with refracting faces. `faces`: corners by index, in order around each face, either way round.
// Throws InvalidArgument for fewer than four faces, an index out of range, a face that is not planar (to 1e-9 of the
// body's size), an edge that does not join exactly two faces (an open body), a body that is not convex, an index
// below 1, more faces than `most_faces_of_a_body` (each is held against every corner: 0.6 s at that number).
constexpr int most_faces_of_a_body = 20000;
std::vector<Face> make_body(const std::vector<Eigen::Vector3d>& corners, const std::vector<std::vector<int>>& faces,
                            Medium glass, const Placement& placement = {});

// Bodies by name; lengths in mm, all positive, angles in rad. Origins and axes before placement:
// Plate: origin in the middle, faces of width x height (x, y) square to z, `thickness` along z.
std::vector<Face> make_plate(double width, double height, double thickness, Medium glass,
                             const Placement& placement = {});
// Wedge: a plate whose face at +z is turned by `angle` about y, so that it is thicker at +x; `thickness` in the middle.
std::vector<Face> make_wedge(double width, double height, double thickness, double angle, Medium glass,
                             const Placement& placement = {});
// Prism: a triangle in the x-z plane with its apex on +z and the apex angle there, both sides of length `side`, origin
// in the middle of the base, `height` along y. With an apex of pi/2 it is the right-angle prism, the hypotenuse at z =
// 0.
std::vector<Face> make_prism(double side, double height, double apex, Medium glass, const Placement& placement = {});
// Corner cube: three faces square to each other that meet in the origin, cut off at z = `depth`, where light enters
// along -z.
std::vector<Face> make_corner_cube(double depth, Medium glass, const Placement& placement = {});
// Cube beam splitter of two prisms: origin in the middle, faces square to x, y and z; the last face is the splitting
// one in the plane x = z, glass on both sides. It sends light that runs along +z to +x, and along -z to -x. It ends
// 1e-4 of the edge before the outer faces, which single precision could not tell from it where they meet: light in that
// margin, as beside a coating's clear aperture, goes straight on.
std::vector<Face> make_cube_splitter(double edge, Medium glass, double reflectance = 0.5, double absorptance = 0.0,
                                     const Placement& placement = {});

// Flat pieces in the x-y plane, origin in the middle, width x height (x, y), the same from either side: a mirror, which
// absorbs what it does not reflect, and a screen, which absorbs all light.
std::vector<Face> make_mirror(double width, double height, double reflectance = 1.0, const Placement& placement = {});
std::vector<Face> make_screen(double width, double height, const Placement& placement = {});

}  // namespace stepdiag
