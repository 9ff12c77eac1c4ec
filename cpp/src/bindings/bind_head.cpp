#include "bindings.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/head/head.hpp"

namespace stepdiag::bindings {
namespace {

void bind_beam(py::module_& m) {
    const auto position = py::arg("position") = zeros(3);
    const auto rotation = py::arg("rotation") = zeros(3);
    const Interferometer standard;
    py::class_<HeadBeam>(m, "HeadBeam",
                         "A light source of a head, its beam along +z of its own frame. Lengths in mm, wavelength (in "
                         "vacuum) in nm, rotation vector in rad.")
        .def_static(
            "interferometer",
            [](const std::string& name, const ArrayLike& place, const ArrayLike& turn, double wavelength,
               double waist_radius, double waist_position, double aperture, double acceptance, double least_coupling,
               double resolution, double periodic_amplitude, double dead_path, double index_error,
               const std::string& model) {
                HeadBeam beam{name, to_placement(place, turn), {wavelength, waist_radius, waist_position}, {}, {}};
                beam.interferometer =
                    Interferometer{aperture,           acceptance, least_coupling, resolution,
                                   periodic_amplitude, dead_path,  index_error,    parse_reading_model(model)};
                check_interferometer(*beam.interferometer);
                return beam;
            },
            py::arg("name"), py::kw_only(), position, rotation, py::arg("wavelength") = 1530.0,
            py::arg("waist_radius") = 0.8, py::arg("waist_position") = 0.0, py::arg("aperture") = standard.aperture,
            py::arg("acceptance") = standard.acceptance, py::arg("least_coupling") = standard.least_coupling,
            py::arg("resolution") = standard.resolution, py::arg("periodic_amplitude") = standard.periodic_amplitude,
            py::arg("dead_path") = standard.dead_path, py::arg("index_error") = standard.index_error,
            py::arg("reading_model") = name(standard.model),
            "A beam that an interferometer measures with: it is taken back by a square of edge `aperture` around the "
            "source, within the angle `acceptance` (rad). reading_model: \"chief_ray\" or \"coupled_mode\".")
        .def_static(
            "spot",
            [](const std::string& name, const std::string& sensor, const ArrayLike& place, const ArrayLike& turn,
               double wavelength, double waist_radius, double waist_position, double housing) {
                return HeadBeam{
                    name,   to_placement(place, turn), {wavelength, waist_radius, waist_position}, std::nullopt, sensor,
                    housing};
            },
            py::arg("name"), py::kw_only(), py::arg("sensor"), position, rotation, py::arg("wavelength") = 635.0,
            py::arg("waist_radius") = 0.8, py::arg("waist_position") = 0.0, py::arg("housing") = HeadBeam{}.housing,
            "A conventional laser whose beam comes to a sensor; `housing`: edge of the square around it that stops "
            "light.")
        .def_readonly("name", &HeadBeam::name)
        .def_readonly("sensor", &HeadBeam::sensor)
        .def_property_readonly("is_interferometer", [](const HeadBeam& b) { return b.interferometer.has_value(); })
        .def_property_readonly("wavelength", [](const HeadBeam& beam) { return beam.mode.wavelength; })
        .def_property_readonly("waist_radius", [](const HeadBeam& beam) { return beam.mode.waist_radius; })
        .def_property_readonly("waist_position", [](const HeadBeam& beam) { return beam.mode.waist_position; })
        .def_property_readonly(
            "size", [](const HeadBeam& b) { return b.interferometer ? b.interferometer->aperture : b.housing; },
            "Edge of the square around the source, mm.")
        .def_property_readonly("position",
                               [](const HeadBeam& beam) { return to_numpy_vector(beam.placement.position); })
        .def_property_readonly("rotation", [](const HeadBeam& beam) { return to_numpy(beam.placement.rotation); });
}

void bind_sensor(py::module_& m) {
    const auto position = py::arg("position") = zeros(3);
    const auto rotation = py::arg("rotation") = zeros(3);
    const LateralEffect psd;
    const Camera pixels;
    py::class_<SpotSensor>(m, "SpotSensor", "A sensor in the x-y plane of its own frame; mm, rotation vector in rad.")
        .def_static(
            "lateral_effect",
            [](const std::string& name, const ArrayLike& place, const ArrayLike& turn, const ArrayLike& size,
               double noise, double resolution, double least_power) {
                const LateralEffect device{to_vector2(size, "size"), noise, resolution, least_power};
                check_lateral_effect(device);
                return SpotSensor{name, to_placement(place, turn), device};
            },
            py::arg("name"), py::kw_only(), position, rotation, py::arg("size") = py::make_tuple(10.0, 10.0),
            py::arg("noise") = psd.noise, py::arg("resolution") = psd.resolution,
            py::arg("least_power") = psd.least_power, "A lateral-effect position sensing device.")
        .def_static(
            "camera",
            [](const std::string& name, const ArrayLike& place, const ArrayLike& turn, double pixel, int columns,
               int rows, double electrons, double background, double read_noise, bool shot_noise, double full_well,
               int bits, const std::string& centroid, double threshold) {
                const Camera device{pixel,      columns,    rows,      electrons, background,
                                    read_noise, shot_noise, full_well, bits,      parse_centroid(centroid),
                                    threshold};
                check_camera(device);
                return SpotSensor{name, to_placement(place, turn), device};
            },
            py::arg("name"), py::kw_only(), position, rotation, py::arg("pixel") = pixels.pixel,
            py::arg("columns") = pixels.columns, py::arg("rows") = pixels.rows, py::arg("electrons") = pixels.electrons,
            py::arg("background") = pixels.background, py::arg("read_noise") = pixels.read_noise,
            py::arg("shot_noise") = pixels.shot_noise, py::arg("full_well") = pixels.full_well,
            py::arg("bits") = pixels.bits, py::arg("centroid") = name(pixels.centroid),
            py::arg("threshold") = pixels.threshold,
            "A pixel array; centroid: \"gaussian_fit\" or \"centre_of_gravity\".")
        .def_readonly("name", &SpotSensor::name)
        .def_property_readonly("size", [](const SpotSensor& sensor) { return to_numpy_vector(sensor.size()); })
        .def_property_readonly("position",
                               [](const SpotSensor& sensor) { return to_numpy_vector(sensor.placement.position); })
        .def_property_readonly("rotation",
                               [](const SpotSensor& sensor) { return to_numpy(sensor.placement.rotation); });
}

}  // namespace

Placement to_placement(const ArrayLike& position, const ArrayLike& rotation) {
    const Eigen::Vector3d place = to_vector3(position, "position"), turn = to_vector3(rotation, "rotation");
    if (!place.allFinite()) throw InvalidArgument("position: expected three finite lengths");
    if (!turn.allFinite()) throw InvalidArgument("rotation: expected three finite angles");
    return {place, rotation_exp(turn)};
}

void bind_head(py::module_& m) {
    py::class_<Environment>(m, "Environment", "The air around machine and head: a constant refractive index.")
        .def(py::init([](double index) {
                 const Environment environment{index};
                 refractive_index(environment, 0.0);  // checks it
                 return environment;
             }),
             py::arg("refractive_index") = 1.0)
        .def_static(
            "from_air",
            [](double temperature, double pressure, double humidity, double carbon_dioxide,
               const std::string& equation) {
                const Environment environment{Air{temperature, pressure, humidity, carbon_dioxide},
                                              parse_air_equation(equation)};
                refractive_index(environment, 633.0);  // checks it
                return environment;
            },
            py::kw_only(), py::arg("temperature") = Air{}.temperature, py::arg("pressure") = Air{}.pressure,
            py::arg("relative_humidity") = Air{}.relative_humidity, py::arg("carbon_dioxide") = Air{}.carbon_dioxide,
            py::arg("equation") = "ciddor",
            "From the state of the air: degrees Celsius, Pa, 0..1, ppm; equation: \"ciddor\", \"modified_edlen\" or "
            "\"edlen_1966\". Raises InvalidArgument outside their ranges.")
        .def(
            "refractive_index",
            [](const Environment& environment, double wavelength) { return refractive_index(environment, wavelength); },
            py::arg("wavelength"), "Phase index at a vacuum wavelength (nm).");

    py::class_<HeadCalibration>(m, "HeadCalibration",
                                "What evaluators know of a head: the constants that its readings are reduced with, mm.")
        .def_readonly("psd_distance", &HeadCalibration::psd_distance)
        .def_property_readonly("spot_beam", [](const HeadCalibration& c) { return to_numpy_vector(c.spot_beam); })
        .def_property_readonly("beam_offsets",
                               [](const HeadCalibration& c) {
                                   Eigen::MatrixXd offsets(c.beam_offsets.size(), 2);
                                   for (std::size_t i = 0; i < c.beam_offsets.size(); ++i)
                                       offsets.row(Eigen::Index(i)) = c.beam_offsets[i].transpose();
                                   return to_numpy(offsets);
                               })
        .def_property_readonly("head_constants", [](const HeadCalibration& c) { return to_numpy(c.head_constants); });

    bind_body(m);
    bind_beam(m);
    bind_sensor(m);
    py::class_<HeadDesign>(m, "HeadDesign", "A laser head as drawn: bodies, beams and sensors in the head's frame.")
        .def(py::init([](const std::string& name, const std::string& layout, const std::vector<HeadBody>& bodies,
                         const std::vector<HeadBeam>& beams, const std::vector<SpotSensor>& sensors, int most_hits,
                         double least_power) {
                 HeadDesign design{name, parse_head_layout(layout), bodies, beams, sensors, {}};
                 design.limits.most_hits = most_hits;
                 design.limits.least_power = least_power;
                 py::gil_scoped_release release;
                 check_design(design);
                 return design;
             }),
             py::arg("name"), py::arg("layout"), py::arg("bodies"), py::arg("beams"),
             py::arg("sensors") = std::vector<SpotSensor>{}, py::kw_only(),
             py::arg("most_hits") = TreeLimits{}.most_hits, py::arg("least_power") = TreeLimits{}.least_power,
             "Raises InvalidArgument for names given twice, a layout without its beams or sensor, components that "
             "overlap or touch, a beam that does not come back from a mirror square to it.")
        .def_readonly("name", &HeadDesign::name)
        .def_property_readonly("layout", [](const HeadDesign& design) { return name(design.layout); })
        .def_readonly("bodies", &HeadDesign::bodies)
        .def_readonly("beams", &HeadDesign::beams)
        .def_readonly("sensors", &HeadDesign::sensors);
}

}  // namespace stepdiag::bindings
