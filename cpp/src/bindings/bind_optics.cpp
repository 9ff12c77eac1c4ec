#include "bindings.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/head/design.hpp"

namespace stepdiag::bindings {
namespace {

Material to_material(const MaterialLike& material) {
    if (py::isinstance<py::str>(material)) return find_glass(material.cast<std::string>());
    if (PyFloat_Check(material.ptr()) || PyLong_Check(material.ptr())) {
        const double index = material.cast<double>();
        refractive_index(Material(index), 0.0);  // checks it
        return index;
    }
    throw InvalidArgument("material: expected the name of a glass or an index of at least 1");
}

// Coated faces reflect a part of the light.
std::vector<Face> coated(std::vector<Face> faces, double reflectance) {
    if (!(reflectance >= 0.0 && reflectance <= 1.0)) throw InvalidArgument("reflectance: expected a share from 0 to 1");
    for (Face& face : faces)
        if (face.surface == Surface::refracting && reflectance > 0.0) {
            face.surface = Surface::splitting;
            face.reflectance = reflectance;
        }
    return faces;
}

HeadBody make_part(const std::string& name, std::vector<Face> faces, const Material& material,
                   const ArrayLike& position, const ArrayLike& rotation) {
    return {name, std::move(faces), material, to_placement(position, rotation)};
}

const char* name_of(Surface surface) {
    switch (surface) {
        case Surface::reflecting: return "reflecting";
        case Surface::absorbing: return "absorbing";
        case Surface::refracting: return "refracting";
        case Surface::splitting: break;
    }
    return "splitting";
}

std::vector<DoubleArray> outlines(const HeadBody& body) {
    std::vector<DoubleArray> arrays;
    for (const Face& face : placed(body.faces, body.placement)) {
        Eigen::MatrixXd corners(face.outline.size(), 3);
        for (std::size_t k = 0; k < face.outline.size(); ++k) corners.row(Eigen::Index(k)) = face.outline[k];
        arrays.push_back(to_numpy(corners));
    }
    return arrays;
}

const Medium glass{1.5};  // placeholder until the wavelength is known

}  // namespace

void bind_optics(py::module_& m) {
    const auto position = py::arg("position") = zeros(3);
    const auto rotation = py::arg("rotation") = zeros(3);
    const auto reflectance = py::arg("reflectance") = 0.0;
    py::class_<HeadBody>(
        m, "HeadBody",
        "A body of a head: flat faces in its own frame, placed in the head's. Lengths in mm; rotation: a rotation "
        "vector in rad about the body's origin; material: a glass by name or an absolute index; reflectance: share of "
        "the power that each of its faces sends back (0: coated so that none is). All raise InvalidArgument.")
        .def_static(
            "plate",
            [](const std::string& name, double width, double height, double thickness, const MaterialLike& material,
               const ArrayLike& place, const ArrayLike& turn, double share) {
                return make_part(name, coated(make_plate(width, height, thickness, glass), share),
                                 to_material(material), place, turn);
            },
            py::arg("name"), py::kw_only(), py::arg("width"), py::arg("height"), py::arg("thickness"),
            py::arg("material"), position, rotation, reflectance, "Plate: origin in the middle, thickness along z.")
        .def_static(
            "wedge",
            [](const std::string& name, double width, double height, double thickness, double angle,
               const MaterialLike& material, const ArrayLike& place, const ArrayLike& turn, double share) {
                return make_part(name, coated(make_wedge(width, height, thickness, angle, glass), share),
                                 to_material(material), place, turn);
            },
            py::arg("name"), py::kw_only(), py::arg("width"), py::arg("height"), py::arg("thickness"), py::arg("angle"),
            py::arg("material"), position, rotation, reflectance,
            "Wedge: a plate whose face at +z is turned by `angle` (rad) about y, thicker at +x.")
        .def_static(
            "cube_splitter",
            [](const std::string& name, double edge, const MaterialLike& material, double share, double absorptance,
               const ArrayLike& place, const ArrayLike& turn) {
                return make_part(name, make_cube_splitter(edge, glass, share, absorptance), to_material(material),
                                 place, turn);
            },
            py::arg("name"), py::kw_only(), py::arg("edge"), py::arg("material"), py::arg("reflectance") = 0.5,
            py::arg("absorptance") = 0.0, position, rotation,
            "Two prisms with a splitting face between them: origin in the middle; see make_cube_splitter for the way "
            "it sends light. reflectance, absorptance: of the splitting face.")
        .def_static(
            "right_angle_prism",
            [](const std::string& name, double side, double height, const MaterialLike& material,
               const ArrayLike& place, const ArrayLike& turn, double share) {
                return make_part(name, coated(make_prism(side, height, 0.5 * pi, glass), share), to_material(material),
                                 place, turn);
            },
            py::arg("name"), py::kw_only(), py::arg("side"), py::arg("height"), py::arg("material"), position, rotation,
            reflectance, "Right-angle prism: origin in the middle of the hypotenuse, the right angle on +z.")
        .def_static(
            "corner_cube",
            [](const std::string& name, double depth, const MaterialLike& material, const ArrayLike& place,
               const ArrayLike& turn, double share) {
                return make_part(name, coated(make_corner_cube(depth, glass), share), to_material(material), place,
                                 turn);
            },
            py::arg("name"), py::kw_only(), py::arg("depth"), py::arg("material"), position, rotation, reflectance,
            "Corner cube: origin in the corner, light enters at z = depth along -z.")
        .def_static(
            "mirror",
            [](const std::string& name, double width, double height, double share, const ArrayLike& place,
               const ArrayLike& turn) { return make_part(name, make_mirror(width, height, share), 1.0, place, turn); },
            py::arg("name"), py::kw_only(), py::arg("width"), py::arg("height"), py::arg("reflectance") = 1.0, position,
            rotation, "A mirror in its own x-y plane, reflecting on both sides.")
        .def_static(
            "screen",
            [](const std::string& name, double width, double height, const ArrayLike& place, const ArrayLike& turn) {
                return make_part(name, make_screen(width, height), 1.0, place, turn);
            },
            py::arg("name"), py::kw_only(), py::arg("width"), py::arg("height"), position, rotation,
            "A screen in its own x-y plane that absorbs all light.")
        .def_static(
            "polyhedron",
            [](const std::string& name, const ArrayLike& corners, const std::vector<std::vector<int>>& faces,
               const MaterialLike& material, const ArrayLike& place, const ArrayLike& turn, double share) {
                const Points points = to_points(corners, "corners");
                std::vector<Eigen::Vector3d> list;
                for (Eigen::Index k = 0; k < points.rows(); ++k) list.push_back(points.row(k));
                return make_part(name, coated(make_body(list, faces, glass), share), to_material(material), place,
                                 turn);
            },
            py::arg("name"), py::kw_only(), py::arg("corners"), py::arg("faces"), py::arg("material"), position,
            rotation, reflectance,
            "A convex polyhedron: corners (n, 3), faces as lists of corner indices in order around each face. It must "
            "be closed, its faces planar.")
        .def_readonly("name", &HeadBody::name, "As the description has it.")
        .def_property_readonly("material",
                               [](const HeadBody& body) -> std::variant<std::string, double> {
                                   if (const Glass* of = std::get_if<Glass>(&body.material)) return of->name;
                                   return std::get<double>(body.material);
                               })
        .def_property_readonly("position",
                               [](const HeadBody& body) { return to_numpy_vector(body.placement.position); })
        .def_property_readonly(
            "rotation", [](const HeadBody& body) { return to_numpy(body.placement.rotation); }, "head_R_body, (3, 3).")
        .def_property_readonly("outlines", &outlines, "The faces' corners in the head's frame, a (k, 3) array each.")
        .def_property_readonly("surfaces", [](const HeadBody& body) {
            std::vector<std::string> names;
            for (const Face& face : body.faces) names.push_back(name_of(face.surface));
            return names;
        });
}

}  // namespace stepdiag::bindings
