#include "bindings.hpp"
#include "stepdiag/core/instruction_set.hpp"

namespace stepdiag::bindings {

void bind_instruction_set(py::module_& m) {
    m.def("instruction_set", &instruction_set,
          "The instruction set of this processor that is in use, such as \"AVX3\": traces and random numbers have the "
          "same bits for the same one.");
    m.def("instruction_sets", &instruction_sets, "Those that this processor has, fastest first.");
    m.def("choose_instruction_set", &choose_instruction_set, py::arg("name"),
          "For the whole process, from now on; by default the fastest is in use. Raises InvalidArgument.");
}

}  // namespace stepdiag::bindings
