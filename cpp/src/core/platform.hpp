// What differs between operating systems and processors. Internal: not installed. platform_posix.cpp or
// platform_windows.cpp is compiled, and no other source asks which system this is.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// A function for processors that can multiply and add at once, to be called where has_fused_multiply_add().
#if defined(__x86_64__)
#define STEPDIAG_FUSED [[gnu::target("avx2,fma")]]
#else
#define STEPDIAG_FUSED
#endif

namespace stepdiag {

// Whether functions marked STEPDIAG_FUSED differ from others, and this processor executes them.
inline bool has_fused_multiply_add() {
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return false;
#endif
}

// Reads a whole file; its path is UTF-8. Throws InvalidArgument if it cannot be read, is a folder or a device, is
// larger, or is a pipe that no program opens for writing within two seconds.
std::string read_bytes(const std::string& path, std::size_t largest);

// Writes to a temporary file in the same folder, then renames it. `path` is never a partly written file. Throws
// InvalidArgument if the file cannot be written, or is read-only.
void replace_file(const std::string& path, std::string_view content);

}  // namespace stepdiag
