#include "bindings.hpp"
#include "stepdiag/uncertainty/inputs.hpp"

namespace stepdiag::bindings {

void bind_uncertain_inputs(py::module_& m) {
    py::class_<Distribution>(
        m, "Distribution",
        "A distribution that JCGM 101 (6.4) assigns to an input quantity: \"normal\" (spread: standard deviation), "
        "\"rectangular\", \"triangular\", \"arcsine\" (half width), \"t\" (scale; degrees_of_freedom), "
        "\"curvilinear_trapezoid\" (half width, known to plus and minus edge only).")
        .def(py::init([](const std::string& kind, double spread, double expectation, double degrees_of_freedom,
                         double edge) {
                 const Distribution distribution{parse_distribution_kind(kind), expectation, spread, degrees_of_freedom,
                                                 edge};
                 check(distribution, kind);
                 return distribution;
             }),
             py::arg("kind") = name(DistributionKind::normal), py::kw_only(), py::arg("spread"),
             py::arg("expectation") = Distribution{}.expectation,
             py::arg("degrees_of_freedom") = Distribution{}.degrees_of_freedom, py::arg("edge") = Distribution{}.edge,
             "degrees_of_freedom of a kind other than t: those of its standard uncertainty (GUM G.4). Raises "
             "InvalidArgument for a spread below 0, an edge not between 0 and the half width, degrees of freedom not "
             "above 0 (t: 2).")
        .def_property_readonly("kind", [](const Distribution& d) { return name(d.kind); })
        .def_readonly("expectation", &Distribution::expectation)
        .def_readonly("spread", &Distribution::spread)
        .def_readonly("degrees_of_freedom", &Distribution::degrees_of_freedom)
        .def_readonly("edge", &Distribution::edge)
        .def_property_readonly("standard_uncertainty", &Distribution::standard_uncertainty);

    m.def("normal_quantile", &normal_quantile, py::arg("probability"),
          "The number that a standard normal number is below with this probability. Raises InvalidArgument.");
    m.def("t_quantile", &t_quantile, py::arg("probability"), py::arg("degrees_of_freedom"),
          "The same of Student's t distribution (coverage factors, GUM G.3). Raises InvalidArgument.");

    py::class_<UncertainInput>(
        m, "UncertainInput",
        "An input quantity that is drawn once for each virtual calibration, as a deviation added to what is nominal. "
        "quantity: \"reflector\", \"laser\" (rad, component a, b: 0, 1), \"psd_zero\", \"lateral\" (mm, x, y), "
        "\"distance_constant\" (mm), \"beam_constant\" (mm, of beam `component`), \"roll\" (rad), \"gain\" (1), "
        "\"drift\" (mm/s), \"scale_length\" (mm), \"scale_factor\" (1): of a line; \"part_shift\" (mm), "
        "\"part_rotation\" (rad): of a part of the head; \"psd_distance\", \"beam_offset\" (mm), \"reading_model\" "
        "(1): of the head; \"temperature\" (degrees Celsius), \"pressure\" (Pa), \"humidity\" (1), "
        "\"refractive_index\", \"wavelength\" (1, relative): of the air; \"machine_drift\" (mm/s, x, y, z).")
        .def(py::init([](const std::string& quantity, const Distribution& distribution, const std::string& line,
                         const std::string& part, const IntegerLike& component) {
                 return UncertainInput{parse_input_quantity(quantity), distribution, line, part,
                                       to_int(component, "component")};
             }),
             py::arg("quantity"), py::arg("distribution"), py::kw_only(), py::arg("line") = "", py::arg("part") = "",
             py::arg("component") = integer(0), "Raises InvalidArgument for a quantity that is not known.")
        .def_property_readonly("quantity", [](const UncertainInput& input) { return name(input.quantity); })
        .def_readonly("distribution", &UncertainInput::distribution)
        .def_readonly("line", &UncertainInput::line)
        .def_readonly("part", &UncertainInput::part)
        .def_readonly("component", &UncertainInput::component)
        .def_property_readonly("name", [](const UncertainInput& input) { return name(input); });

    py::class_<ReadingNoise>(
        m, "ReadingNoise",
        "What is drawn for every reading or pose. quantity: \"channel\" (of the channel named), \"common\" (mm, one "
        "draw a reading for all its distances), \"head_walk\", \"machine_walk\" (mm/sqrt(s), random walks), "
        "\"position\" (mm), \"orientation\" (rad): repeatability of the machine, component x, y, z.")
        .def(py::init([](const std::string& quantity, const Distribution& distribution, const std::string& channel,
                         const IntegerLike& component) {
                 return ReadingNoise{parse_noise_quantity(quantity), distribution, channel,
                                     to_int(component, "component")};
             }),
             py::arg("quantity"), py::arg("distribution"), py::kw_only(), py::arg("channel") = "",
             py::arg("component") = integer(0), "Raises InvalidArgument for a quantity that is not known.")
        .def_property_readonly("quantity", [](const ReadingNoise& noise) { return name(noise.quantity); })
        .def_readonly("distribution", &ReadingNoise::distribution)
        .def_readonly("channel", &ReadingNoise::channel)
        .def_readonly("component", &ReadingNoise::component)
        .def_property_readonly("name", [](const ReadingNoise& noise) { return name(noise); });

    using Correlation = std::pair<std::vector<int>, ArrayLike>;
    py::class_<UncertainInputs>(m, "UncertainInputs", "What is uncertain about a virtual calibration.")
        .def(py::init([](std::vector<UncertainInput> inputs, std::vector<ReadingNoise> noise,
                         const std::vector<Correlation>& correlations) {
                 UncertainInputs all{std::move(inputs), std::move(noise)};
                 for (const Correlation& correlation : correlations)
                     all.correlations.push_back({correlation.first, to_matrix(correlation.second, "correlation")});
                 check(all);
                 return all;
             }),
             py::arg("inputs") = std::vector<UncertainInput>{}, py::arg("noise") = std::vector<ReadingNoise>{},
             py::arg("correlations") = std::vector<Correlation>{},
             "correlations: pairs of indices of normal inputs and their correlation matrix. Raises InvalidArgument for "
             "an input given twice, a line, part or component that its quantity does not have, a matrix that is no "
             "correlation.")
        .def_readonly("inputs", &UncertainInputs::inputs)
        .def_readonly("noise", &UncertainInputs::noise)
        .def_property_readonly("correlations", [](const UncertainInputs& all) {
            std::vector<std::pair<std::vector<int>, DoubleArray>> correlations;
            for (const CorrelatedInputs& correlated : all.correlations)
                correlations.emplace_back(correlated.members, to_numpy(correlated.correlation));
            return correlations;
        });
}

}  // namespace stepdiag::bindings
