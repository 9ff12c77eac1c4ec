// Simple binary format: a text with kind and version, numbers in little-endian byte order, a CRC-32 at the end.
// Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace stepdiag {

class ByteWriter {
public:
    explicit ByteWriter(std::string_view kind) : bytes_(kind) {}

    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    void number(Number value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void size(std::size_t value) { number(std::uint64_t(value)); }
    void text(const std::string& text);
    void doubles(const double* values, std::size_t count);  // does not write `count`
    void indices(const std::vector<std::size_t>& values);
    void matrix(const Eigen::MatrixXd& matrix);
    void counts(const std::vector<std::uint32_t>& counts);  // compact: seven bits per byte, lengths of runs of zeros

    std::string finish() &&;

private:
    void variable(std::uint64_t value);
    std::string bytes_;
};

// Throws InvalidArgument, whose message begins with `name`, if the bytes are of another kind, damaged or incomplete.
class ByteReader {
public:
    ByteReader(std::string_view bytes, std::string_view kind, std::string name);

    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    Number number() {
        Number value;
        take(&value, sizeof value);
        return value;
    }
    // A number of items. Each item must take at least one byte, so a damaged size is detected early.
    std::size_t size();
    std::string text();
    void doubles(double* values, std::size_t count) { take(values, count * sizeof(double)); }
    std::vector<std::size_t> indices();
    Eigen::MatrixXd matrix();
    void counts(std::vector<std::uint32_t>& counts);  // reads counts.size() numbers
    void finish() const;                              // throws if bytes remain
    void expect(bool condition) const {               // throws if the content read is inconsistent
        if (!condition) damaged();
    }

private:
    [[noreturn]] void damaged() const;
    void take(void* to, std::size_t size);
    std::uint64_t variable();
    std::string_view left_;
    std::string name_;
};

}  // namespace stepdiag
