#include "bindings.hpp"
#include "stepdiag/optics/replay.hpp"

namespace stepdiag::bindings {

void bind_instruction_set(py::module_& m) {
    m.def("instruction_set", &replay_target,
          "The instruction set of this processor that is in use, such as \"AVX3\": traces and random numbers have the "
          "same bits for the same one.");
    m.def("instruction_sets", &replay_targets, "Those that this processor has, fastest first.");
    m.def("choose_instruction_set", &choose_replay_target, py::arg("name"),
          "For the whole process, from now on; by default the fastest is in use. Raises InvalidArgument.");
}

}  // namespace stepdiag::bindings
