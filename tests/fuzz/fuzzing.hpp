// What the fuzz targets share. A target aborts where a claim does not hold, and libFuzzer keeps the input.
#pragma once

#include <fuzzer/FuzzedDataProvider.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "stepdiag/core/error.hpp"

namespace fuzzing {

inline void expect(bool holds, const char* claim) {
    if (holds) return;
    std::fprintf(stderr, "does not hold: %s\n", claim);
    std::abort();
}

// Whether the call refuses: an InvalidArgument whose message says something. Any other exception ends the program.
template <class Call>
bool refused(Call&& call) {
    try {
        call();
        return false;
    } catch (const stepdiag::InvalidArgument& error) {
        expect(std::strlen(error.what()) > 10, "a refusal has a reason");
        return true;
    }
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}
// The same up to a NUL byte, which no reader of a file lets through.
inline std::string_view text_before_nul(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = text_of(data, size);
    return text.substr(0, text.find('\0'));
}

// A file in memory, for readers that take a path.
class FileInMemory {
public:
    explicit FileInMemory(std::string_view content) : file_(::memfd_create("fuzz", MFD_CLOEXEC)) {
        expect(file_ >= 0 && ::write(file_, content.data(), content.size()) == ssize_t(content.size()), "memory");
        path_ = "/proc/self/fd/" + std::to_string(file_);
    }
    ~FileInMemory() { ::close(file_); }
    FileInMemory(const FileInMemory&) = delete;
    FileInMemory& operator=(const FileInMemory&) = delete;
    const std::string& path() const { return path_; }

private:
    int file_;
    std::string path_;
};

// An input of a target that takes more than a file: the file's text, a NUL byte (which no good file has), and the bytes
// from which everything else is chosen. A file alone is an input too.
struct FileAndChoices {
    FileAndChoices(const std::uint8_t* data, std::size_t size)
        : text(text_before_nul(data, size)), choices(data + text.size(), size - text.size()) {}
    std::string text;
    FuzzedDataProvider choices;
};

// Sensible numbers and those that hurt.
inline constexpr std::array<double, 24> numbers = {0.0,   -0.0,  1.0,   -1.0,   0.1,   1e-3,     10.0,   99.0,
                                                   100.0, 250.0, -10.0, 400.0,  800.0, 1e-12,    1e-30,  5e-324,
                                                   1e6,   -1e6,  1e100, -1e150, 1e308, -1.7e308, 1e-308, 3.0};
inline double any_number(FuzzedDataProvider& bytes) {
    const auto pick = bytes.ConsumeIntegralInRange<std::size_t>(0, numbers.size() + 2);
    if (pick < numbers.size()) return numbers[pick];
    if (pick == numbers.size()) return std::numeric_limits<double>::quiet_NaN();
    return pick == numbers.size() + 1 ? std::numeric_limits<double>::infinity()
                                      : -std::numeric_limits<double>::infinity();
}
inline std::array<double, 3> any_vector(FuzzedDataProvider& bytes) {
    const double x = any_number(bytes), y = any_number(bytes), z = any_number(bytes);
    return {x, y, z};
}

inline bool is_finite(const std::array<double, 3>& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}
inline bool same_bits(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::memcmp(a.data(), b.data(), sizeof a) == 0;
}

}  // namespace fuzzing
