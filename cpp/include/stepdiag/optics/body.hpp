// Flat faces with an outline, and glass bodies made of such faces. Lengths in mm, angles in rad, scene frame.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/surface.hpp"

namespace stepdiag {

// A convex polygon in a plane. The plane is stored in double precision in addition to the outline, because it
// determines where a ray meets the face. A plane from Embree's single-precision vertices would be wrong by tenths of a
// micrometre.
struct Face {
    Eigen::Vector3d point;                 // a point of the plane, mm
    Eigen::Vector3d normal;                // unit vector; points out of a body
    std::vector<Eigen::Vector3d> outline;  // three or more corners in order, mm
    Surface surface;
    Medium behind = {};                 // refracting, splitting: medium on the side opposite to the normal
    std::optional<Medium> before = {};  // medium on the side of the normal; empty: the ambient medium
    double reflectance = 1.0;           // reflecting, splitting: reflected share of the power, 0 to 1
    double absorptance = 0.0;           // splitting: absorbed share of the power; the rest is transmitted
};

// A rectangle in the local x-y plane of `scene_R_face`, centred at `centre`, with its normal along local z. `size`:
// edges along local x and y, mm.
Face make_rectangle(const Eigen::Vector3d& centre, const Eigen::Matrix3d& scene_R_face, const Eigen::Vector2d& size,
                    Surface surface);

// Position and orientation of a body in the scene.
struct Placement {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();      // of the body's origin, mm
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // scene_R_body
};

// Transforms faces from the body's own frame to the scene frame.
std::vector<Face> placed(std::vector<Face> faces, const Placement& placement);

// A convex polyhedron with refracting faces. `faces` lists the corners of each face by index, in order, clockwise or
// counter-clockwise. Throws InvalidArgument for:
//   - fewer than four faces, or more than `most_faces_of_a_body` (the check of each face against every corner takes
//     0.6 s at that number)
//   - a corner index out of range, or a face that is not planar to 1e-9 of the body's size
//   - an edge that does not join exactly two faces (an open body), or a body that is not convex
//   - a refractive index below 1
constexpr int most_faces_of_a_body = 20000;
std::vector<Face> make_body(const std::vector<Eigen::Vector3d>& corners, const std::vector<std::vector<int>>& faces,
                            Medium glass, const Placement& placement = {});

// Standard bodies. Lengths are in mm and must be positive; angles are in rad. The descriptions give the body's own
// frame, before placement.
//
// Plate: origin in the middle, faces of width x height (x, y) perpendicular to z, `thickness` along z.
std::vector<Face> make_plate(double width, double height, double thickness, Medium glass,
                             const Placement& placement = {});
// Wedge: a plate whose face at +z is rotated by `angle` about y. It is thicker at +x and has `thickness` in the middle.
std::vector<Face> make_wedge(double width, double height, double thickness, double angle, Medium glass,
                             const Placement& placement = {});
// Prism: an isosceles triangle in the x-z plane with two sides of length `side` and the angle `apex` between them, at
// +z. The origin is in the middle of the base; `height` is along y. An apex of pi/2 gives a right-angle prism with its
// hypotenuse in the plane z = 0.
std::vector<Face> make_prism(double side, double height, double apex, Medium glass, const Placement& placement = {});
// Corner cube: three mutually perpendicular faces that meet at the origin. The entrance face is at z = `depth`; light
// enters along -z.
std::vector<Face> make_corner_cube(double depth, Medium glass, const Placement& placement = {});
// Cube beam splitter of two prisms: origin in the middle, faces perpendicular to x, y and z. The last face is the
// splitting face in the plane x = z, with glass on both sides. It reflects light from +z to +x and from -z to -x. The
// splitting face ends 1e-4 of the edge before the outer faces, because single precision cannot separate faces that
// meet. Light in this margin is transmitted, as outside the clear aperture of a coating.
std::vector<Face> make_cube_splitter(double edge, Medium glass, double reflectance = 0.5, double absorptance = 0.0,
                                     const Placement& placement = {});

// Flat pieces of width x height (x, y) in the x-y plane, origin in the middle, with equal sides. A mirror absorbs the
// light that it does not reflect; a screen absorbs all light.
std::vector<Face> make_mirror(double width, double height, double reflectance = 1.0, const Placement& placement = {});
std::vector<Face> make_screen(double width, double height, const Placement& placement = {});

}  // namespace stepdiag
