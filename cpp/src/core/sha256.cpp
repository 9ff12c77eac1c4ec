#include "core/sha256.hpp"

#include <sha2.h>
#include <sys/types.h>  // sha2.h needs it

#include <array>
#include <cstdint>

namespace stepdiag {

std::string sha256(std::string_view bytes) {
    SHA2_CTX context;
    SHA256Init(&context);
    SHA256Update(&context, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    std::array<char, SHA256_DIGEST_STRING_LENGTH> digits;
    return SHA256End(&context, digits.data());
}

}  // namespace stepdiag
