// SHA-256 (FIPS 180-4) by libmd. Internal: not installed.
#pragma once

#include <string>
#include <string_view>

namespace stepdiag {

// 64 hexadecimal digits in lower case, as `sha256sum` prints them.
std::string sha256(std::string_view bytes);

}  // namespace stepdiag
