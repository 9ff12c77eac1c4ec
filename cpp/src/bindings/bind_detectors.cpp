#include <pybind11/stl.h>

#include <cmath>

#include "bindings.hpp"
#include "stepdiag/head/interferometer.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag::bindings {
namespace {

const Interferometer no_interferometer;
const Camera no_camera;
const LateralEffect no_device;

std::int64_t to_counter(const IntegerLike& counter) {
    return to_integer(counter, "counter", 0, std::numeric_limits<std::int64_t>::max());
}

double to_index(double index, const char* name) {
    if (!(std::isfinite(index) && index > 0.0))
        throw InvalidArgument(std::string(name) + ": expected a refractive index above 0, got " +
                              std::string(py::repr(py::float_(index))));
    return index;
}

ReturnedBeam make_returned_beam(const ArrayLike& position, const ArrayLike& direction, double optical_length,
                                double reduced_length) {
    const ReturnedBeam beam{to_vector2(position, "position"), to_vector3(direction, "direction"), optical_length,
                            reduced_length};
    if (!beam.position.allFinite()) throw InvalidArgument("position: expected two finite lengths in mm");
    if (!(std::abs(beam.direction.norm() - 1.0) < 1e-6 && beam.direction.z() < 0.0))
        throw InvalidArgument("direction: expected a unit vector that comes back, z < 0");
    if (!std::isfinite(optical_length)) throw InvalidArgument("optical_length: expected a finite length in mm");
    if (!std::isfinite(reduced_length)) throw InvalidArgument("reduced_length: expected a finite length in mm");
    return beam;
}

Eigen::MatrixXd to_image(const ArrayLike& object) {
    const DoubleArray array = DoubleArray::ensure(object);
    if (!array) PyErr_Clear();
    if (!array || array.ndim() != 2)
        throw InvalidArgument("image: expected an array of electrons, rows x columns, got " +
                              (array ? "shape " + std::string(py::str(py::object(array.attr("shape"))))
                                     : std::string(py::str(py::type::handle_of(object)))));
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

std::optional<DoubleArray> to_position(const std::optional<Eigen::Vector2d>& position) {
    return position ? std::optional(to_numpy_vector(*position)) : std::nullopt;
}

void bind_interferometer(py::module_& m) {
    py::class_<GaussianMode>(m, "GaussianMode",
                             "A collimator's Gaussian mode: vacuum wavelength in nm, waist radius (1/e^2 of power) and "
                             "the waist's place along the beam from the collimator's plane (t/n) in mm.")
        .def(py::init([](double wavelength, double waist_radius, double waist_position) {
                 const GaussianMode mode{wavelength, waist_radius, waist_position};
                 check_gaussian_mode(mode);
                 return mode;
             }),
             py::arg("wavelength"), py::arg("waist_radius"), py::arg("waist_position") = 0.0,
             "Raises InvalidArgument for what is not positive or not finite.")
        .def_readonly("wavelength", &GaussianMode::wavelength)
        .def_readonly("waist_radius", &GaussianMode::waist_radius)
        .def_readonly("waist_position", &GaussianMode::waist_position)
        .def_property_readonly("rayleigh_length", &rayleigh_length, "pi w0^2 / wavelength, mm (reduced: t/n).");

    py::class_<ReturnedBeam>(
        m, "ReturnedBeam", "A beam that has come back, in the collimator's frame (beam out along +z, its plane z = 0).")
        .def(py::init(&make_returned_beam), py::arg("position"), py::arg("direction"), py::arg("optical_length"),
             py::arg("reduced_length"),
             "position: (2,), where the axis meets the collimator's plane, mm; direction: (3,), unit, z < 0; "
             "optical_length and reduced_length: sums of n t and of t / n out and back, mm. Raises InvalidArgument "
             "naming what makes no sense.")
        .def_property_readonly("position", [](const ReturnedBeam& beam) { return to_numpy_vector(beam.position); })
        .def_property_readonly("direction", [](const ReturnedBeam& beam) { return to_numpy_vector(beam.direction); })
        .def_readonly("optical_length", &ReturnedBeam::optical_length)
        .def_readonly("reduced_length", &ReturnedBeam::reduced_length);

    py::class_<Interferometer>(m, "Interferometer",
                               "What an interferometer makes of the light that comes back to its collimator.")
        .def(py::init([](double aperture, double acceptance, double least_coupling, double resolution,
                         double periodic_amplitude, double dead_path, double index_error,
                         const std::string& reading_model) {
                 const Interferometer interferometer{
                     aperture,           acceptance, least_coupling, resolution,
                     periodic_amplitude, dead_path,  index_error,    parse_reading_model(reading_model)};
                 check_interferometer(interferometer);
                 return interferometer;
             }),
             py::kw_only(), py::arg("aperture") = no_interferometer.aperture,
             py::arg("acceptance") = no_interferometer.acceptance,
             py::arg("least_coupling") = no_interferometer.least_coupling,
             py::arg("resolution") = no_interferometer.resolution,
             py::arg("periodic_amplitude") = no_interferometer.periodic_amplitude,
             py::arg("dead_path") = no_interferometer.dead_path, py::arg("index_error") = no_interferometer.index_error,
             py::arg("reading_model") = name(no_interferometer.model),
             "aperture: edge of the square that takes the beam back, mm; acceptance: largest angle of the returned "
             "beam, "
             "rad; least_coupling: share of the light; resolution, periodic_amplitude, dead_path: mm; index_error: "
             "relative; reading_model: \"chief_ray\" or \"coupled_mode\". Raises InvalidArgument naming the value.")
        .def_readonly("aperture", &Interferometer::aperture)
        .def_readonly("acceptance", &Interferometer::acceptance)
        .def_readonly("least_coupling", &Interferometer::least_coupling)
        .def_readonly("resolution", &Interferometer::resolution)
        .def_readonly("periodic_amplitude", &Interferometer::periodic_amplitude)
        .def_readonly("dead_path", &Interferometer::dead_path)
        .def_readonly("index_error", &Interferometer::index_error)
        .def_property_readonly("reading_model", [](const Interferometer& i) { return name(i.model); });

    m.def(
        "couple",
        [](const GaussianMode& mode, const ReturnedBeam& beam, double index) {
            const Coupling coupling = couple(mode, beam, to_index(index, "index"));
            return std::pair(coupling.optical_length, coupling.efficiency);
        },
        py::arg("mode"), py::arg("beam"), py::arg("index") = 1.0,
        "Round trip as the fibre's phase has it (mm) and share of the light that couples: the overlap integral of the "
        "returned beam with the mode in a medium of this index, in closed form (Joyce and DeLoach, Appl. Opt. 23 "
        "(1984) "
        "4187); the phase that an aligned beam gains by diffraction is taken off.");
    m.def(
        "read_distance",
        [](const Interferometer& interferometer, const GaussianMode& mode, const ReturnedBeam& beam, double true_index,
           double assumed_index) {
            return read_distance(interferometer, mode, beam, to_index(true_index, "true_index"),
                                 to_index(assumed_index, "assumed_index"));
        },
        py::arg("interferometer"), py::arg("mode"), py::arg("beam"), py::kw_only(), py::arg("true_index") = 1.0,
        py::arg("assumed_index") = 1.0,
        "The distance that the instrument gives, mm; None where the beam is outside aperture, acceptance or least "
        "coupling.");
}

void bind_spot(py::module_& m) {
    py::class_<BeamSpot>(
        m, "BeamSpot",
        "A beam's spot on a sensor: centre (2,) and radius (1/e^2 of power) in mm, share of the source's "
        "power.")
        .def(py::init([](const ArrayLike& centre, double radius, double power) {
                 const BeamSpot spot{to_vector2(centre, "spot centre"), radius, power};
                 check_spot(spot);
                 return spot;
             }),
             py::arg("centre"), py::arg("radius"), py::arg("power") = 1.0,
             "Raises InvalidArgument for what is not finite, no radius or a negative power.")
        .def_property_readonly("centre", [](const BeamSpot& spot) { return to_numpy_vector(spot.centre); })
        .def_readonly("radius", &BeamSpot::radius)
        .def_readonly("power", &BeamSpot::power);

    m.def("beam_radius", &beam_radius, py::arg("mode"), py::arg("reduced_length"),
          "Radius (1/e^2 of power, mm) of a beam after a reduced length (sum of t/n, mm) from the collimator's plane.");
    m.def(
        "power_inside",
        [](const BeamSpot& spot, const ArrayLike& low, const ArrayLike& high) {
            return power_inside(spot, to_vector2(low, "low"), to_vector2(high, "high"));
        },
        py::arg("spot"), py::arg("low"), py::arg("high"),
        "Share of the source's power that a spot has in the rectangle between two corners (2,), mm.");
}

void bind_camera(py::module_& m) {
    py::class_<Camera>(m, "Camera", "A pixel array and how a spot is located on it.")
        .def(py::init([](double pixel, const IntegerLike& columns, const IntegerLike& rows, double electrons,
                         double background, double read_noise, bool shot_noise, double full_well,
                         const IntegerLike& bits, const std::string& centroid, double threshold) {
                 const Camera camera{pixel,
                                     to_int(columns, "camera columns"),
                                     to_int(rows, "camera rows"),
                                     electrons,
                                     background,
                                     read_noise,
                                     shot_noise,
                                     full_well,
                                     to_int(bits, "camera bits"),
                                     parse_centroid(centroid),
                                     threshold};
                 check_camera(camera);
                 return camera;
             }),
             py::kw_only(), py::arg("pixel") = no_camera.pixel, py::arg("columns") = integer(no_camera.columns),
             py::arg("rows") = integer(no_camera.rows), py::arg("electrons") = no_camera.electrons,
             py::arg("background") = no_camera.background, py::arg("read_noise") = no_camera.read_noise,
             py::arg("shot_noise") = no_camera.shot_noise, py::arg("full_well") = no_camera.full_well,
             py::arg("bits") = integer(no_camera.bits), py::arg("centroid") = name(no_camera.centroid),
             py::arg("threshold") = no_camera.threshold,
             "pixel: pitch, mm; electrons: of a whole spot of power 1; background (a pixel), read_noise (standard "
             "deviation), full_well: electrons; bits: of the converter over the full well, 0: not quantised; centroid: "
             "\"gaussian_fit\" or \"centre_of_gravity\", the latter of what exceeds the threshold, a share of the "
             "brightest pixel above background. Raises InvalidArgument naming the value.")
        .def_readonly("pixel", &Camera::pixel)
        .def_readonly("columns", &Camera::columns)
        .def_readonly("rows", &Camera::rows)
        .def_readonly("electrons", &Camera::electrons)
        .def_readonly("background", &Camera::background)
        .def_readonly("read_noise", &Camera::read_noise)
        .def_readonly("shot_noise", &Camera::shot_noise)
        .def_readonly("full_well", &Camera::full_well)
        .def_readonly("bits", &Camera::bits)
        .def_property_readonly("centroid", [](const Camera& camera) { return name(camera.centroid); })
        .def_readonly("threshold", &Camera::threshold);

    m.def(
        "expose",
        [](const Camera& camera, const std::vector<BeamSpot>& spots, const IntegerLike& seed,
           const IntegerLike& counter) {
            const std::uint64_t s = to_seed(seed), c = std::uint64_t(to_counter(counter));
            Eigen::MatrixXd image;
            {
                const py::gil_scoped_release release;
                image = expose(camera, spots, s, c);
            }
            return to_numpy(image);
        },
        py::arg("camera"), py::arg("spots"), py::kw_only(), py::arg("seed") = integer(0),
        py::arg("counter") = integer(0),
        "Image in electrons, shape (rows, columns), pixel (0, 0) at the lowest x and y; the array is centred on the "
        "sensor's origin. The noise depends on seed and counter alone. Raises InvalidArgument for a seed outside 0 .. "
        "2^64 - 1.");
    m.def(
        "cramer_rao_bound",
        [](const Camera& camera, const BeamSpot& spot) {
            const py::gil_scoped_release release;
            return cramer_rao_bound(camera, spot);
        },
        py::arg("camera"), py::arg("spot"),
        "Smallest standard deviation (mm) of the spot's x that an unbiased estimate can have with position, radius, "
        "brightness and background unknown (Winick, J. Opt. Soc. Am. A 3 (1986) 1809); 0 without noise, inf where x is "
        "not observable.");
}

void bind_locate(py::module_& m) {
    py::class_<LateralEffect>(
        m, "LateralEffect",
        "A lateral-effect position sensing device: it gives the power centroid of what falls on it.")
        .def(py::init([](const ArrayLike& size, double noise, double resolution, double least_power) {
                 const LateralEffect device{to_vector2(size, "size"), noise, resolution, least_power};
                 check_lateral_effect(device);
                 return device;
             }),
             py::kw_only(), py::arg("size") = py::make_tuple(no_device.size.x(), no_device.size.y()),
             py::arg("noise") = no_device.noise, py::arg("resolution") = no_device.resolution,
             py::arg("least_power") = no_device.least_power,
             "size: (2,) of the active area, mm; noise: standard deviation at full power, mm, growing as 1 / power; "
             "resolution: mm; least_power: share of the source's power, below which a reading is lost. Raises "
             "InvalidArgument naming the value.")
        .def_property_readonly("size", [](const LateralEffect& device) { return to_numpy_vector(device.size); })
        .def_readonly("noise", &LateralEffect::noise)
        .def_readonly("resolution", &LateralEffect::resolution)
        .def_readonly("least_power", &LateralEffect::least_power);

    m.def(
        "locate",
        [](const Camera& camera, const ArrayLike& array) {
            const Eigen::MatrixXd image = to_image(array);
            std::optional<Eigen::Vector2d> position;
            {
                const py::gil_scoped_release release;
                position = locate(camera, image);
            }
            return to_position(position);
        },
        py::arg("camera"), py::arg("image"),
        "Position (2,) of the spot in an image (rows, columns) of electrons, mm from the sensor's origin; None where "
        "nothing can be located. Raises InvalidArgument for an image of another shape or not finite.");
    m.def(
        "locate",
        [](const LateralEffect& device, const std::vector<BeamSpot>& spots, const IntegerLike& seed,
           const IntegerLike& counter) {
            return to_position(locate(device, spots, to_seed(seed), std::uint64_t(to_counter(counter))));
        },
        py::arg("device"), py::arg("spots"), py::kw_only(), py::arg("seed") = integer(0),
        py::arg("counter") = integer(0),
        "Position (2,) that the device gives for these spots, mm from its centre; None below its least power.");
}

}  // namespace

void bind_detectors(py::module_& m) {
    bind_interferometer(m);
    bind_spot(m);
    bind_camera(m);
    bind_locate(m);
}

}  // namespace stepdiag::bindings
