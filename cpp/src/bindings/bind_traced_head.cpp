#include "bindings.hpp"
#include "stepdiag/head/sensitivity.hpp"
#include "stepdiag/head/traced_reading.hpp"

namespace stepdiag::bindings {
namespace {

const HeadDesign& design_of(const Head& head) {
    if (!head.design) throw InvalidArgument("head: expected one with a design (Head.from_design)");
    return *head.design;
}

// The mirror that a head is looked at with: its own, or one that no beam of a sensible head misses.
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

// A segment of a ray tree, for drawing and for the account of powers.
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

constexpr double drawn_length = 50.0;  // mm: of a segment that leaves

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

void bind_traced_head(py::module_& m) {
    py::register_exception<ReplayMismatch>(m, "ReplayMismatch", PyExc_RuntimeError);
    py::class_<BeamSegment>(m, "BeamSegment", "A straight piece of a beam's way, in the sensor frame, mm.")
        .def_readonly("beam", &BeamSegment::beam)
        .def_readonly("parent", &BeamSegment::parent, "Index of the segment it comes from; -1: the source.")
        .def_property_readonly("start", [](const BeamSegment& s) { return to_numpy_vector(s.start); })
        .def_property_readonly(
            "end", [](const BeamSegment& s) { return to_numpy_vector(s.end); },
            "Where it meets a face; 50 mm on where it leaves.")
        .def_readonly("index", &BeamSegment::index, "Refractive index of what it runs in.")
        .def_readonly("power", &BeamSegment::power, "Share of the source's power.")
        .def_property_readonly(
            "fate", [](const BeamSegment& s) { return std::string(s.fate); },
            "\"goes_on\", \"absorbed\", \"left\" or \"cut\".")
        .def_readonly("arrives", &BeamSegment::arrives, "Name of the detector that it arrives at, or None.");
    m.def("trace_beams", &trace_beams, py::arg("head"), py::kw_only(), py::arg("distance"), py::arg("tilt") = zeros(2),
          py::arg("lateral") = zeros(2), py::arg("environment") = std::nullopt,
          "All light of a traced head, as segments: the mirror's centre at (lateral, distance) in the sensor frame, "
          "mm, its tilts (alpha, beta) in rad. A parent stands before its children. Raises InvalidArgument.");
    py::class_<Sensitivity>(m, "Sensitivity",
                            "First derivatives of a head's readings by one parameter: signals (n,) in mm by its unit, "
                            "and reading (3,): distance (mm), alpha and beta (rad).")
        .def_readonly("component", &Sensitivity::component)
        .def_readonly("quantity", &Sensitivity::quantity)
        .def_readonly("unit", &Sensitivity::unit)
        .def_property_readonly("signals", [](const Sensitivity& s) { return to_numpy_vector(s.signals); })
        .def_property_readonly("reading", [](const Sensitivity& s) { return to_numpy_vector(s.reading); });
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
    m.def("read_head", &read_head, py::arg("head"), py::kw_only(), py::arg("distance"), py::arg("tilt") = zeros(2),
          py::arg("lateral") = zeros(2), py::arg("environment") = std::nullopt,
          py::arg("assumed_environment") = std::nullopt,
          "The signals of a traced head for one mirror pose, by the trace of all its light; None for a lost one.");
}

}  // namespace stepdiag::bindings
