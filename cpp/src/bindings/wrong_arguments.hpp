// The line for arguments that no function takes.
#pragma once

#include "bindings.hpp"

namespace stepdiag::bindings {

// After everything else is bound: it changes how the functions of the module are called.
void bind_wrong_arguments(py::module_& m);

}  // namespace stepdiag::bindings
