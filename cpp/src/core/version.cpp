#include "stepdiag/version.hpp"

namespace stepdiag {

const char* version() { return STEPDIAG_VERSION; }

}  // namespace stepdiag
