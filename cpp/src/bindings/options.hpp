// Option structs in Python: functions take one as `options`, or its fields by name. The fields are listed where the
// struct is bound, and nowhere else.
#pragma once

#include <optional>

#include "bindings.hpp"

namespace stepdiag::bindings {

using Fields = py::KWArgs<py::object>;

// Throws InvalidArgument if both are given. An unknown field is a TypeError, as with any Python function.
template <class Options>
Options options_of(const std::optional<Options>& given, const Fields& fields) {
    if (!given) return py::type::of<Options>()(**fields).template cast<Options>();
    if (!fields.empty()) throw InvalidArgument("options: expected options or their fields by name, got both");
    return *given;
}

}  // namespace stepdiag::bindings
