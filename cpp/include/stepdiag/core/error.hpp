// A caller's mistake is an exception; a physical outcome (a miss, a lost reading, a rank deficiency) is a typed value.
#pragma once

#include <stdexcept>
#include <string>

namespace stepdiag {

// Thrown for bad input only. The message names the argument (or file and row, or key), what was expected and what came.
// Python sees a ValueError.
class InvalidArgument : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

}  // namespace stepdiag
