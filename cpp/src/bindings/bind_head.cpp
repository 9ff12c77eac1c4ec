#include <pybind11/stl.h>

#include <cmath>

#include "bindings.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/head/head.hpp"
#include "stepdiag/head/interferometer.hpp"
#include "stepdiag/head/sensitivity.hpp"
#include "stepdiag/head/spot_sensor.hpp"
#include "stepdiag/head/traced_reading.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {

template <>
ReadingModel parsed<ReadingModel>(const std::string& word) {
    return parse_reading_model(word);
}

namespace {

void bind_beam(py::module_& m) {
    const auto position = py::arg("position") = zeros(3);
    const auto rotation = py::arg("rotation") = zeros(3);
    const Interferometer standard;
    bind_record(m, "HeadBeam",
                "A light source of a head, its beam along +z of its own frame. Lengths in mm, wavelength (in "
                "vacuum) in nm, rotation vector in rad.",
                field("name", &HeadBeam::name, "As the description has it."),
                field("sensor", &HeadBeam::sensor, "Name of the sensor it comes to; empty of an interferometer."))
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
        .def_property_readonly(
            "is_interferometer", [](const HeadBeam& b) { return b.interferometer.has_value(); },
            "Otherwise it is a laser to a sensor.")
        .def_property_readonly(
            "wavelength", [](const HeadBeam& beam) { return beam.mode.wavelength; }, "In vacuum, nm.")
        .def_property_readonly(
            "waist_radius", [](const HeadBeam& beam) { return beam.mode.waist_radius; }, "1/e^2 of power, mm")
        .def_property_readonly(
            "waist_position", [](const HeadBeam& beam) { return beam.mode.waist_position; },
            "Along the beam from its source, mm.")
        .def_property_readonly(
            "size", [](const HeadBeam& b) { return b.interferometer ? b.interferometer->aperture : b.housing; },
            "Edge of the square around the source, mm.")
        .def_property_readonly("position",
                               [](const HeadBeam& beam) { return to_numpy_vector(beam.placement.position); })
        .def_property_readonly(
            "rotation", [](const HeadBeam& beam) { return to_numpy(beam.placement.rotation); }, "head_R_beam, (3, 3).");
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
        .def_readonly("name", &SpotSensor::name, "As the description has it.")
        .def_property_readonly(
            "size", [](const SpotSensor& sensor) { return to_numpy_vector(sensor.size()); },
            "(2,) width and height, mm")
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

// --- detectors ---

namespace {

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

void check_returned(const ReturnedBeam& beam) {
    if (!beam.position.allFinite()) throw InvalidArgument("position: expected two finite lengths in mm");
    if (!(std::abs(beam.direction.norm() - 1.0) < 1e-6 && beam.direction.z() < 0.0))
        throw InvalidArgument("direction: expected a unit vector that comes back, z < 0");
    if (!std::isfinite(beam.optical_length)) throw InvalidArgument("optical_length: expected a finite length in mm");
    if (!std::isfinite(beam.reduced_length)) throw InvalidArgument("reduced_length: expected a finite length in mm");
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
    bind_options<GaussianMode, 3>(m, "GaussianMode", "A collimator's Gaussian mode.", &check_gaussian_mode,
                                  required("wavelength", &GaussianMode::wavelength, "In vacuum, nm."),
                                  required("waist_radius", &GaussianMode::waist_radius, "1/e^2 of power, mm"),
                                  field("waist_position", &GaussianMode::waist_position,
                                        "Along the beam from the collimator's plane, reduced (t/n), mm."))
        .def_property_readonly("rayleigh_length", &rayleigh_length, "pi w0^2 / wavelength, mm (reduced: t/n).");

    bind_options<ReturnedBeam, 4>(
        m, "ReturnedBeam", "A beam that has come back, in the collimator's frame (beam out along +z, its plane z = 0).",
        &check_returned,
        required("position", &ReturnedBeam::position, "(2,), where the axis meets the collimator's plane, mm"),
        required("direction", &ReturnedBeam::direction, "(3,), unit, z < 0"),
        required("optical_length", &ReturnedBeam::optical_length, "Sum of n t out and back, mm."),
        required("reduced_length", &ReturnedBeam::reduced_length, "Sum of t/n out and back, mm."));

    bind_options<Interferometer>(
        m, "Interferometer", "What an interferometer makes of the light that comes back to its collimator.",
        &check_interferometer,
        field("aperture", &Interferometer::aperture, "Edge of the square that takes the beam back, mm."),
        field("acceptance", &Interferometer::acceptance, "Largest angle of the returned beam, rad."),
        field("least_coupling", &Interferometer::least_coupling, "Share of the light."),
        field("resolution", &Interferometer::resolution, "mm"),
        field("periodic_amplitude", &Interferometer::periodic_amplitude, "mm"),
        field("dead_path", &Interferometer::dead_path, "mm"),
        field("index_error", &Interferometer::index_error, "Relative."),
        field("reading_model", &Interferometer::model, "\"chief_ray\" or \"coupled_mode\"."));

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
        .def_readonly("columns", &Camera::columns, "Pixels along x.")
        .def_readonly("rows", &Camera::rows, "Pixels along y.")
        .def_readonly("electrons", &Camera::electrons)
        .def_readonly("background", &Camera::background)
        .def_readonly("read_noise", &Camera::read_noise)
        .def_readonly("shot_noise", &Camera::shot_noise, "Whether the light is counted in quanta.")
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

static void bind_detectors(py::module_& m) {
    bind_interferometer(m);
    bind_spot(m);
    bind_camera(m);
    bind_locate(m);
}

// --- traced heads ---

namespace {

const HeadDesign& design_of(const Head& head) {
    if (!head.design) throw InvalidArgument("head: expected one with a design (Head.from_design)");
    return *head.design;
}

// Size of the mirror for drawings: the head's own, or one that no beam of a usual head misses.
Eigen::Vector2d mirror_of(const Head& head) {
    if (head.mirror) return *head.mirror;
    double widest = 0.0;
    for (const HeadBeam& beam : design_of(head).beams)
        widest = std::max(widest, beam.placement.position.head<2>().cwiseAbs().maxCoeff());
    return Eigen::Vector2d::Constant(100.0 + 2.0 * widest);
}

MirrorPose to_mirror(const Head& head, double distance, const ArrayLike& tilt, const ArrayLike& lateral) {
    const double nearest = reach(design_of(head));
    const Eigen::Vector2d angles = to_vector2(tilt, "tilt"), place = to_vector2(lateral, "lateral");
    if (!place.allFinite()) throw InvalidArgument("lateral: expected two finite lengths");
    if (!(distance > nearest) || !std::isfinite(distance))
        throw InvalidArgument("distance: expected more than the " + std::to_string(nearest) +
                              " mm that the head reaches, got " + std::to_string(distance) + " mm");
    if (!(angles.cwiseAbs().maxCoeff() < 1.0)) throw InvalidArgument("tilt: expected angles below 1 rad");
    return tilted_mirror({place.x(), place.y(), distance}, angles.x(), angles.y());
}

// A segment of a ray tree, for drawings and power budgets.
struct BeamSegment {
    std::string beam;
    int parent;
    Eigen::Vector3d start, end;
    double index, power;
    const char* fate;
    std::optional<std::string> arrives;
};

const char* name_of(SegmentEnd end) {
    switch (end) {
        case SegmentEnd::goes_on: return "goes_on";
        case SegmentEnd::absorbed: return "absorbed";
        case SegmentEnd::left: return "left";
        case SegmentEnd::cut: break;
    }
    return "cut";
}

constexpr double drawn_length = 50.0;  // mm, of a segment that leaves the head

std::vector<BeamSegment> trace_beams(const Head& head, double distance, const ArrayLike& tilt, const ArrayLike& lateral,
                                     const std::optional<Environment>& environment) {
    const HeadDesign& design = design_of(head);
    const MirrorPose mirror = to_mirror(head, distance, tilt, lateral);
    py::gil_scoped_release release;
    const TracedHead traced(design, head.pose_errors, environment.value_or(usual_environment(head)), mirror_of(head));
    std::vector<BeamSegment> result;
    for (std::size_t b = 0; b < design.beams.size(); ++b) {
        const int first = int(result.size());
        for (const Segment& s : traced.trace(int(b), mirror).segments) {
            BeamSegment& segment = result.emplace_back();
            segment.beam = design.beams[b].name;
            segment.parent = s.parent < 0 ? -1 : first + s.parent;
            segment.start = s.ray.origin;
            segment.end = s.hit ? s.hit->point : Eigen::Vector3d(s.ray.origin + drawn_length * s.ray.direction);
            segment.index = s.index;
            segment.power = s.power;
            segment.fate = name_of(s.end);
            if (s.hit && s.end == SegmentEnd::absorbed && s.hit->face == traced.detector_face(int(b)))
                segment.arrives = design.beams[b].interferometer ? design.beams[b].name : design.beams[b].sensor;
        }
    }
    return result;
}

std::map<std::string, std::optional<double>> read_head(const Head& head, double distance, const ArrayLike& tilt,
                                                       const ArrayLike& lateral,
                                                       const std::optional<Environment>& environment,
                                                       const std::optional<Environment>& assumed) {
    design_of(head);
    const MirrorPose mirror = to_mirror(head, distance, tilt, lateral);
    py::gil_scoped_release release;
    const SignalRow row =
        TracedReader(head, mirror_of(head), {environment.value_or(usual_environment(head)), assumed, {}, 0})
            .trace(mirror);
    const std::vector<std::string> names = signal_names(head);
    std::map<std::string, std::optional<double>> readings;
    for (std::size_t c = 0; c < names.size(); ++c) readings[names[c]] = row[c];
    return readings;
}

}  // namespace

static void bind_traced_head(py::module_& m) {
    py::register_exception<ReplayMismatch>(m, "ReplayMismatch", PyExc_RuntimeError).attr("__doc__") =
        "A replayed pose differs from its trace, because another face is in the path of the beam; it names the pose.";
    bind_record(m, "BeamSegment", "A straight piece of a beam's way, in the sensor frame, mm.",
                field("beam", &BeamSegment::beam),
                field("parent", &BeamSegment::parent, "Index of the segment it comes from; -1: the source."),
                field("start", &BeamSegment::start, "(3,) mm"),
                field("end", &BeamSegment::end, "Where it meets a face; 50 mm on where it leaves."),
                field("index", &BeamSegment::index, "Refractive index of what it runs in."),
                field("power", &BeamSegment::power, "Share of the source's power."),
                field("arrives", &BeamSegment::arrives, "Name of the detector that it arrives at, or None."))
        .def_property_readonly(
            "fate", [](const BeamSegment& s) { return std::string(s.fate); },
            "\"goes_on\", \"absorbed\", \"left\" or \"cut\".");
    m.def("trace_beams", &trace_beams, py::arg("head"), py::kw_only(), py::arg("distance"), py::arg("tilt") = zeros(2),
          py::arg("lateral") = zeros(2), py::arg("environment") = std::nullopt,
          "All light of a traced head, as segments: the mirror's centre at (lateral, distance) in the sensor frame, "
          "mm, its tilts (alpha, beta) in rad. A parent stands before its children. Raises InvalidArgument.");
    bind_record(m, "Sensitivity",
                "First derivatives of a head's readings by one parameter: signals (n,) in mm by its unit, "
                "and reading (3,): distance (mm), alpha and beta (rad).",
                field("component", &Sensitivity::component, "Its name; \"mirror\", \"air\", \"all interferometers\"."),
                field("quantity", &Sensitivity::quantity,
                      "\"shift x\", ..., \"rotation x\", ..., \"index\", \"temperature\", \"pressure\", \"humidity\""),
                field("unit", &Sensitivity::unit, "Of the quantity: \"mm\", \"rad\", \"1\", \"K\", \"Pa\""),
                field("signals", &Sensitivity::signals, "(n,) change of the signals by unit of the quantity, mm"),
                field("reading", &Sensitivity::reading,
                      "(3,) change of distance (mm), alpha and beta (rad) by unit of the quantity"));
    m.def(
        "head_sensitivities",
        [](const Head& head, double distance, const ArrayLike& tilt, const ArrayLike& lateral,
           const std::optional<Environment>& environment) {
            const MirrorPose mirror = to_mirror(head, distance, tilt, lateral);
            const Eigen::Vector2d size = mirror_of(head);
            py::gil_scoped_release release;
            return head_sensitivities(head, mirror, size, environment.value_or(usual_environment(head)));
        },
        py::arg("head"), py::kw_only(), py::arg("distance"), py::arg("tilt") = zeros(2), py::arg("lateral") = zeros(2),
        py::arg("environment") = std::nullopt,
        "Derivatives of a traced head's readings by the six degrees of freedom of every component (along the head's "
        "axes, rotations about its own origin) and of the mirror, by indices, and by the state of the air: exact, by "
        "forward mode through the replay. Raises InvalidArgument where a beam is lost.");
    m.def("read_signals", &read_head, py::arg("head"), py::kw_only(), py::arg("distance"), py::arg("tilt") = zeros(2),
          py::arg("lateral") = zeros(2), py::arg("environment") = std::nullopt,
          py::arg("assumed_environment") = std::nullopt,
          "The signals of a traced head for one mirror pose, by the trace of all its light; None for a lost one.");
}

Heads to_heads(const HeadLike& heads, const Plan& plan) {
    if (py::isinstance<Head>(heads)) return heads.cast<Head>();
    if (!py::isinstance<py::dict>(heads))
        throw InvalidArgument("head: expected a Head, or a dict with one for each line, got " +
                              std::string(py::str(py::type::handle_of(heads))));
    auto by_line = heads.cast<std::map<std::string, Head>>();
    std::vector<Line> lines = plan.lines();
    lines.insert(lines.end(), plan.scale_lines().begin(), plan.scale_lines().end());
    for (const Line& line : lines)
        if (!by_line.count(line.name())) throw InvalidArgument("head: line \"" + line.name() + "\" has none");
    Head first = by_line.begin()->second;
    return {std::move(first), std::move(by_line)};
}

static void bind_head_calibration(py::module_& m) {
    bind_record(
        m, "HeadCalibration", "What evaluators know of a head: the constants that its readings are reduced with, mm.",
        field("psd_distance", &HeadCalibration::psd_distance,
              "Of the unfolded sensor behind the reference plane, mm, reduced: glass counts as t n_air/n; None "
              "without one."),
        field("spot_beam", &HeadCalibration::spot_beam, "(2,) where the beam that makes the spot leaves, (u, v), mm."))
        .def_property_readonly(
            "head_constants", [](const HeadCalibration& c) { return to_numpy(c.head_constants); },
            "What glass and way before the reference plane add to each distance, mm; readings are corrected for it.")
        .def_property_readonly("beam_offsets", [](const HeadCalibration& c) {
            Eigen::MatrixXd offsets(c.beam_offsets.size(), 2);
            for (std::size_t i = 0; i < c.beam_offsets.size(); ++i)
                offsets.row(Eigen::Index(i)) = c.beam_offsets[i].transpose();
            return to_numpy(offsets);
        });
}

static void bind_design(py::module_& m) {
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
        .def_readonly("name", &HeadDesign::name, "As the description has it.")
        .def_property_readonly("layout", [](const HeadDesign& design) { return name(design.layout); })
        .def_readonly("bodies", &HeadDesign::bodies)
        .def_readonly("beams", &HeadDesign::beams)
        .def_readonly("sensors", &HeadDesign::sensors);
}

static void bind_head_of_layout(py::module_& m) {
    py::class_<Head>(
        m, "Head",
        "A laser head by the closed definition of its layout's readings: \"ideal\" (ray-traced), \"psd\" or "
        "\"multi_beam\"; from_design makes a traced one. Lengths in mm, wavelength in nm.")
        .def(py::init([](const std::string& layout, double standoff, double psd_distance,
                         const std::vector<ArrayLike>& beam_offsets, double wavelength, double aperture,
                         const std::optional<ArrayLike>& mirror) {
                 Head head;
                 head.layout = parse_head_layout(layout);
                 head.standoff = standoff;
                 head.psd_distance = psd_distance;
                 head.wavelength = wavelength;
                 head.aperture = aperture;
                 for (const auto& offset : beam_offsets)
                     head.beam_offsets.push_back(to_vector2(offset, "beam_offsets"));
                 if (mirror) head.mirror = to_vector2(*mirror, "mirror");
                 check_head(head);
                 return head;
             }),
             py::arg("layout") = "ideal", py::kw_only(), py::arg("standoff") = Head{}.standoff,
             py::arg("psd_distance") = Head{}.psd_distance, py::arg("beam_offsets") = std::vector<ArrayLike>{},
             py::arg("wavelength") = Head{}.wavelength, py::arg("aperture") = Head{}.aperture,
             py::arg("mirror") = std::nullopt,
             "mirror: (width, height); none: as large as the plan needs. Raises InvalidArgument for lengths that are "
             "not positive and for beams on one line.")
        .def_static(
            "from_design",
            [](const HeadDesign& design, double standoff, const std::optional<ArrayLike>& mirror,
               const std::map<std::string, std::pair<ArrayLike, ArrayLike>>& pose_errors,
               const std::optional<std::string>& reading_model) {
                PoseErrors errors;
                for (const auto& [component, error] : pose_errors)
                    errors[component] = {to_vector3(error.first, "pose_errors"),
                                         to_vector3(error.second, "pose_errors")};
                return make_head(design, standoff, mirror ? std::optional(to_vector2(*mirror, "mirror")) : std::nullopt,
                                 std::move(errors),
                                 reading_model ? std::optional(parse_reading_model(*reading_model)) : std::nullopt);
            },
            py::arg("design"), py::kw_only(), py::arg("standoff") = Head{}.standoff, py::arg("mirror") = std::nullopt,
            py::arg("pose_errors") = py::dict(), py::arg("reading_model") = std::nullopt,
            "A traced head. pose_errors: component name -> (shift in mm, rotation vector in rad about its own origin), "
            "both along the head's axes. reading_model: of all interferometers instead of the design's. Raises "
            "InvalidArgument.")
        .def_property_readonly(
            "design",
            [](const Head& head) { return head.design ? std::optional<HeadDesign>(*head.design) : std::nullopt; })
        .def_property_readonly("calibration", &Head::calibration,
                               "What evaluators know of the head, by a nominal trace where it has a design.")
        .def_property_readonly("layout", [](const Head& head) { return name(head.layout); })
        .def_readonly("standoff", &Head::standoff, "From the beam's origin to a line's first functional point, mm.")
        .def_readonly("psd_distance", &Head::psd_distance, "Of the unfolded sensor behind the reference plane, mm.")
        .def_property_readonly("beam_offsets",
                               [](const Head& head) {
                                   Eigen::MatrixXd offsets(head.beam_offsets.size(), 2);
                                   for (std::size_t i = 0; i < head.beam_offsets.size(); ++i)
                                       offsets.row(i) = head.beam_offsets[i].transpose();
                                   return to_numpy(offsets);
                               })
        .def_readonly("wavelength", &Head::wavelength)
        .def_readonly("aperture", &Head::aperture, "Edge of the square that takes a beam back, mm.")
        .def_property_readonly(
            "mirror",
            [](const Head& head) { return head.mirror ? std::optional(to_numpy_vector(*head.mirror)) : std::nullopt; })
        .def_property_readonly("signals", &signal_names, "Names of the channels that the head reads.");
}

void bind_head(py::module_& m) {
    bind_head_calibration(m);
    bind_beam(m);
    bind_sensor(m);
    bind_design(m);
    bind_head_of_layout(m);
    bind_detectors(m);
    bind_traced_head(m);
}

}  // namespace stepdiag::bindings
