#include "bindings.hpp"
#include "stepdiag/core/air.hpp"
#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/version.hpp"

namespace stepdiag::bindings {

void bind_core(py::module_& m) {
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
        .def_property_readonly(
            "state",
            [](const Environment& environment) -> std::optional<std::map<std::string, double>> {
                const Air* air = std::get_if<Air>(&environment.air);
                if (!air) return std::nullopt;
                return std::map<std::string, double>{{"temperature", air->temperature},
                                                     {"pressure", air->pressure},
                                                     {"relative_humidity", air->relative_humidity},
                                                     {"carbon_dioxide", air->carbon_dioxide}};
            },
            "Arguments of from_air, without the equation; None of a constant index.")
        .def_property_readonly(
            "equation",
            [](const Environment& environment) {
                constexpr const char* names[] = {"ciddor", "modified_edlen", "edlen_1966"};
                return std::string(names[static_cast<int>(environment.equation)]);
            },
            "Of the index, as from_air takes it.")
        .def(
            "refractive_index",
            [](const Environment& environment, double wavelength) { return refractive_index(environment, wavelength); },
            py::arg("wavelength"), "Phase index at a vacuum wavelength (nm).");

    m.def("newer_format", &newer_format, py::arg("expected"), py::arg("given"),
          "The end of a refusal: where `given` is `expected` with a larger number at its end, it says that it takes a "
          "newer stepdiag; else it is empty.");
    m.def("instruction_set", &instruction_set,
          "The instruction set of this processor that is in use, such as \"AVX3\": traces and random numbers have the "
          "same bits for the same one.");
    m.def("instruction_sets", &instruction_sets, "Those that this processor has, fastest first.");
    m.def("choose_instruction_set", &choose_instruction_set, py::arg("name"),
          "For the whole process, from now on; by default the fastest is in use. Raises InvalidArgument.");
}

}  // namespace stepdiag::bindings
