#include "bindings.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace stepdiag::bindings {
namespace {

Eigen::Vector2d to_finite_pair(const ArrayLike& array, const char* key) {
    const Eigen::Vector2d pair = to_vector2(array, key);
    if (!pair.allFinite()) throw InvalidArgument("misalignment " + std::string(key) + ": expected two finite numbers");
    return pair;
}

}  // namespace

void bind_simulation(py::module_& m) {
    py::class_<Head>(
        m, "Head",
        "A laser head: layout \"ideal\" (ray-traced), \"psd\" or \"multi_beam\"; lengths in mm, wavelength in nm.")
        .def(py::init([](const std::string& layout, double standoff, double psd_distance,
                         const std::vector<ArrayLike>& beam_offsets, double wavelength, double aperture,
                         const std::optional<ArrayLike>& mirror) {
                 Head head{parse_head_layout(layout), standoff, psd_distance, {}, wavelength, aperture, std::nullopt};
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
        .def_property_readonly("layout", [](const Head& head) { return name(head.layout); })
        .def_readonly("standoff", &Head::standoff)
        .def_readonly("psd_distance", &Head::psd_distance)
        .def_property_readonly("beam_offsets",
                               [](const Head& head) {
                                   Eigen::MatrixXd offsets(head.beam_offsets.size(), 2);
                                   for (std::size_t i = 0; i < head.beam_offsets.size(); ++i)
                                       offsets.row(i) = head.beam_offsets[i].transpose();
                                   return to_numpy(offsets);
                               })
        .def_readonly("wavelength", &Head::wavelength)
        .def_readonly("aperture", &Head::aperture)
        .def_property_readonly(
            "mirror",
            [](const Head& head) { return head.mirror ? std::optional(to_numpy_vector(*head.mirror)) : std::nullopt; })
        .def_property_readonly("signals", &signal_names, "Names of the channels that the head reads.");

    py::class_<Misalignment>(
        m, "Misalignment",
        "How head and mirror are out of true on a line: reflector and laser angles (a, b) in rad, psd_zero in mm.")
        .def(py::init([](const ArrayLike& reflector, const ArrayLike& laser, const ArrayLike& psd_zero) {
                 return Misalignment{to_finite_pair(reflector, "reflector"), to_finite_pair(laser, "laser"),
                                     to_finite_pair(psd_zero, "psd_zero")};
             }),
             py::arg("reflector") = zeros(2), py::arg("laser") = zeros(2), py::arg("psd_zero") = zeros(2),
             "Raises InvalidArgument for what is no pair of finite numbers.")
        .def_property_readonly("reflector", [](const Misalignment& m) { return to_numpy_vector(m.reflector); })
        .def_property_readonly("laser", [](const Misalignment& m) { return to_numpy_vector(m.laser); })
        .def_property_readonly("psd_zero", [](const Misalignment& m) { return to_numpy_vector(m.psd_zero); });

    py::class_<Noise>(m, "Noise",
                      "Standard deviations of an independent Gaussian per reading: distance (mm; also d1 ...), tilt "
                      "(rad), spot (mm).")
        .def(py::init([](double distance, double tilt, double spot, const IntegerLike& seed) {
                 const Noise noise{distance, tilt, spot, to_seed(seed)};
                 check_noise(noise);
                 return noise;
             }),
             py::arg("distance") = 0.0, py::arg("tilt") = 0.0, py::arg("spot") = 0.0, py::arg("seed") = integer(0),
             "Raises InvalidArgument for a deviation that is negative or not finite, and for a seed outside 0 .. 2^64 "
             "- 1.")
        .def_readonly("distance", &Noise::distance)
        .def_readonly("tilt", &Noise::tilt)
        .def_readonly("spot", &Noise::spot)
        .def_readonly("seed", &Noise::seed);

    m.def(
        "simulate",
        [](const Machine& machine, const Plan& plan, const Head& head,
           const std::map<std::string, Misalignment>& misalignment, const Noise& noise, double refractive_index) {
            py::gil_scoped_release release;
            return simulate(machine, plan, head, {misalignment, noise, Medium{refractive_index}});
        },
        py::arg("machine"), py::arg("plan"), py::arg("head"), py::kw_only(),
        py::arg("misalignment") = std::map<std::string, Misalignment>{}, py::arg("noise") = Noise{},
        py::arg("refractive_index") = 1.0,
        "A run on the virtual machine: lines of the plan, then its scale lines. misalignment: by line name; a line "
        "without an entry is aligned. "
        "Readings whose beam misses the mirror or does not come back are lost (NaN). Raises InvalidArgument.");
}

}  // namespace stepdiag::bindings
