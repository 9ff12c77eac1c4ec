#include "bindings.hpp"
#include "stepdiag/uncertainty/validation.hpp"

namespace stepdiag::bindings {

void bind_validation(py::module_& m) {
    const auto vector = [](auto member) {
        return [member](const Validation& v) { return to_numpy_vector(v.*member); };
    };
    py::class_<Validation>(
        m, "Validation",
        "Propagation beside the Monte Carlo method (JCGM 101, 8), arrays in the order of `outputs`, native units: "
        "validated where neither end of y -+ U is further than delta from that of the symmetric coverage interval.")
        .def_readonly("outputs", &Validation::outputs)
        .def_readonly("coverage", &Validation::coverage)
        .def_readonly("digits", &Validation::digits)
        .def_property_readonly("delta", vector(&Validation::delta),
                               "(m,) half a unit of the last significant digit of u.")
        .def_property_readonly("low", vector(&Validation::low), "(m,) y - U")
        .def_property_readonly("high", vector(&Validation::high), "(m,) y + U")
        .def_property_readonly("d_low", vector(&Validation::d_low), "(m,) |y - U - y_low|")
        .def_property_readonly("d_high", vector(&Validation::d_high), "(m,) |y + U - y_high|")
        .def_property_readonly("sampling", vector(&Validation::sampling),
                               "(m,) standard uncertainty of the Monte Carlo interval's ends by the number of samples; "
                               "should be small beside delta.")
        .def_readonly("validated", &Validation::validated)
        .def_readonly("reason", &Validation::reason,
                      "Where it is not validated, why: which square or distribution, with figures; empty elsewhere.")
        .def_property_readonly("failures", &Validation::failures, "How many outputs are not validated.");

    m.def(
        "compare",
        [](const Propagation& propagation, const MonteCarloResult& monte_carlo,
           const std::optional<IntegerLike>& digits) {
            return digits ? compare(propagation, monte_carlo, to_int(*digits, "digits"))
                          : compare(propagation, monte_carlo);
        },
        py::arg("propagation"), py::arg("monte_carlo"), py::kw_only(), py::arg("digits") = std::nullopt,
        "Validates propagation by the Monte Carlo method at the coverage probability of the latter; digits of u that "
        "matter, 1 to 3 (none: those of the Monte Carlo result). Raises InvalidArgument for results of other outputs.");
}

}  // namespace stepdiag::bindings
